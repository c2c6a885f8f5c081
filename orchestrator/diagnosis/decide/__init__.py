"""How much the data speak for one set of effects against another, and the verdict. Begin at `verdict.py`."""
