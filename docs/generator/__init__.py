"""What the documentation site makes from code and data while it is built: see `hooks.py`."""
