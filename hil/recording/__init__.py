"""Every frame and every cycle of a session, on disk while it runs."""
