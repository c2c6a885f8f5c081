"""An evaluation of flat equations in plain numbers, apart from the translation that builds FMUs."""

from fmus.flat.compare import Comparison, compare

__all__ = ["Comparison", "compare"]
