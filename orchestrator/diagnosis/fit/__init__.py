"""A set of effects as a model with free parameters, fitted by free runs. Begin at `candidates.py`, then `evidence.py`."""
