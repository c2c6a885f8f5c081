"""Masters: how components that are coupled get from one communication point to the next."""

from fmus.errors import MisfitError
from orchestrator.cosim.masters.master import GaussSeidel, Jacobi, Master, MasterSettings, Ordered, TableMaster
from orchestrator.cosim.masters.rollback import Adaptive, Iterative

__all__ = ["MASTERS", "Master", "MasterSettings", "TableMaster", "find_master"]

MASTERS: dict[str, type[Master]] = {kind.name: kind for kind in (Ordered, Jacobi, GaussSeidel, Iterative, Adaptive)}


def find_master(name: str) -> type[Master]:
    """The master of that name.

    Raises:
        MisfitError: if there is none.
    """
    if name not in MASTERS:
        raise MisfitError(f"there is no master {name!r}; choose from {', '.join(MASTERS)}")
    return MASTERS[name]
