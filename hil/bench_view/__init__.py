"""The bench view: a page of the studio that shows a running session, and cannot command it."""
