"""A look at a session that runs, from another process; the loop never waits for it."""
