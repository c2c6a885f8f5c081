"""One component in place of another: what fits, what does not, and the system with the new one in it."""

from orchestrator.cosim.swap.apply import Swap, swap
from orchestrator.cosim.swap.compare import Side, compare_interfaces
from orchestrator.cosim.swap.report import Difference, Match, SwapReport, mapping_text, read_mapping

__all__ = [
    "Difference",
    "Match",
    "Side",
    "Swap",
    "SwapReport",
    "compare_interfaces",
    "mapping_text",
    "read_mapping",
    "swap",
]
