"""An unnamed force: any smooth function of one coordinate, against which the effects that are named there have to hold.

A few effects of a library can approximate a law that it lacks. What no library holds is then better described by a smooth
function of the coordinate on which these effects depend than by them.
"""

import re
from collections.abc import Iterator, Sequence

import numpy as np

from fmus.errors import ComponentError
from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.decide import Judge
from orchestrator.greybox.laws import Law, LawParameter
from orchestrator.greybox.places import Place
from orchestrator.greybox.search import FittedSet, Setting, fit_set

# Humps over the range of the coordinate; a speed ranges over so many times its root mean square to either side.
HUMPS, REACH = 12, 2.0


def unnamed_force(chosen: FittedSet, places: Sequence[Place], setting: Setting, judge: Judge) -> str:
    """Where a smooth force predicts far better than named effects, as a reason for doubt; empty if nowhere.

    It stands alone, or in place of those effects that depend on its coordinate only.

    Args:
        places: where such a force can act; balances count.
    """
    limits = judge.limits
    for candidates, coordinate in _alternatives(chosen, places):
        try:
            other = fit_set(setting, candidates, chosen.fit.noise)
        except (ComponentError, np.linalg.LinAlgError):
            continue
        if judge.beyond_doubt(other, chosen) and judge.ratio(other, chosen) < 1 - limits.least_improvement:
            better = 1 - judge.ratio(other, chosen)
            return f"some other force over {coordinate} predicts {better:.0%} better than these effects"
    return ""


def _alternatives(chosen: FittedSet, places: Sequence[Place]) -> Iterator[tuple[tuple[Candidate, ...], str]]:
    """Sets with a smooth force, and its coordinate."""
    for place in {p.site: p for p in places if p.balance is not None}.values():
        for coordinate in sorted({"q", "v", "x"} & set(place.coordinates)):
            force, variable = Candidate(_smooth(place, coordinate), place), place.coordinates[coordinate]
            yield (force,), variable
            here = [c for c in chosen.candidates if c.place.site == place.site and _depends_on(c) <= {coordinate}]
            rest = tuple(c for c in chosen.candidates if c not in here)
            if rest and any(_depends_on(c) for c in here):
                yield (*rest, force), variable


def _depends_on(candidate: Candidate) -> set[str]:
    """Coordinates of which a law is a function; a law with a memory is one of all of them."""
    if candidate.law.states:
        return set(candidate.place.coordinates)
    return set(re.findall(r"[A-Za-z]\w*", candidate.law.expression)) & set(candidate.place.coordinates)


def _smooth(place: Place, coordinate: str) -> Law:
    """Gaussian humps side by side over the range of a coordinate, each with a gain."""
    reach = REACH * place.scales.get("speed", 1.0)
    low, high = (-reach, reach) if coordinate == "v" else (place.range[0] - place.range[1], sum(place.range))
    centres = np.linspace(low, high, HUMPS)
    width = float(centres[1] - centres[0])
    terms = [f"w{k}*exp(-(({coordinate} - ({c!r}))/{width!r})^2)" for k, c in enumerate(map(float, centres))]
    prior = 10 * place.scales["force"]
    gains = tuple(LawParameter(f"w{k}", "force", gain=True, prior=prior) for k in range(HUMPS))
    return Law(
        f"unnamed_force_over_{coordinate}",
        "a smooth force",
        "motion" if place.kind == "motion" else "storage",
        " + ".join(terms),
        gains,
    )
