"""What a diagnosis leaves open, and the next experiment that would settle it. Begin at `left_open.py`."""
