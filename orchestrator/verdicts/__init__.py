"""What a diagnosis says, whichever method found it: the result, its parts, and how it is read back. Begin at `result.py`."""
