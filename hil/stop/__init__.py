"""The stop button of a browser: a process of its own beside each session, which can stop the arm and nothing else."""
