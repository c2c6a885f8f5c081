"""What an answer is worth to a user, who would rather hear of a class than be misled, in the spirit of the DXC contests."""

from collections.abc import Mapping
from typing import Any

CANNOT_TELL, MISLED = 0.3, -0.5


def utility(row: Mapping[str, Any]) -> float:
    """1 for the truth, 1/size for a class that holds it, 0.3 for a needless "cannot tell", -0.5 for wrong names, else 0.

    >>> utility({"family": "S", "verdict": "named", "said": ["cogging"], "class": False, "class_size": 1})
    -0.5
    """
    right = {"N0": "adequate", "N1": "adequate", "N2": "adequate", "O": "unknown", "I": "cannot_tell"}
    if row["verdict"] == right.get(row["family"]):
        return 1.0
    if row["verdict"] == "cannot_tell":
        return CANNOT_TELL
    if not row["said"]:
        return 0.0
    return 1 / row["class_size"] if row["class"] else MISLED
