"""What is wrong with the structure of a set of equations: which ones are too many, which unknowns are left."""

from collections.abc import Sequence

import casadi as ca

from fmus.symbolic.matching import Matching, rows_of


def singular_message(incidence: ca.Sparsity, unknowns: Sequence[ca.SX], places: Sequence[str]) -> str:
    """Name the equations that contradict or repeat each other, and the unknowns that nothing determines.

    Args:
        incidence: pattern of equations by unknowns, of deficient structural rank.
        unknowns: symbols of the columns.
        places: where each equation is written.
    """
    matching = Matching(rows_of(incidence))
    idle = [row for row in range(incidence.size1()) if not matching.add(row)]
    free = [unknowns[j].name() for j in range(len(unknowns)) if j not in matching.row_of]
    parts = []
    if free:
        parts.append(f"no equation is left to determine {listed(free)}")
    for row in idle[:2]:
        rows, columns = matching.overdetermined(row)
        where = listed(sorted({places[i] for i in rows if places[i]}))
        names = listed([unknowns[j].name() for j in sorted(columns)])
        about = f"determine only {names}" if columns else "contain no unknown"
        parts.append(f"the equations at {where or 'generated places'} {about}")
    place = place_of([places[row] for row in idle])
    return (f"{place}: " if place else "") + "; ".join(parts)


def place_of(places: Sequence[str]) -> str:
    """The first place that is known."""
    return next((place for place in places if place), "")


def listed(names: Sequence[str], most: int = 6) -> str:
    """Join names for a message, the first few of many."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
