"""The search over sets of effects: screening, proposals, fits, and who does the work. Begin at `search.py`."""
