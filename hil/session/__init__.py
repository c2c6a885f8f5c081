"""A session with a robot: start-up, the control cycle, and what it leaves behind."""
