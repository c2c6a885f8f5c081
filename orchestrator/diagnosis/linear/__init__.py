"""Linear analysis of a fitted model along its own motion: responses, tangents, tests against noise. Begin at `tangent.py`."""
