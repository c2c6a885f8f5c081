"""Barrett's Proficio behind the contract of robots (`hil.robots.base`). Begin at `kind.py`."""
