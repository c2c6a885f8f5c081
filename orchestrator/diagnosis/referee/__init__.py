"""Held-out trials judge what the search names, and the answer is put together. Begin at `referee.py`, then `conclude.py`."""
