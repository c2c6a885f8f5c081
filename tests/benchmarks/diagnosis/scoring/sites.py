"""Sites and parameters of truth and diagnosis, made comparable."""

from collections.abc import Mapping
from functools import cache
from typing import Any

from tests.benchmarks.diagnosis.truth.machines import MACHINES

# Values at which an effect is absent, where that is not 0: errors count as shares of the departure from them.
_ABSENT = {"factor": 1.0, "ratio": 1.0, "scale": 1.0}


def site_parts(site: str, model: str) -> set[str]:
    """Parts of a site by the model's own variables, whether a part is called by its number or by its variable.

    >>> sorted(site_parts("joint1+joint2", "arm")), site_parts("phiLoad", "two-mass")
    (['q1', 'q2'], {'phiLoad'})
    >>> site_parts("sensor:q1", "cart"), site_parts("slide1", "cart"), site_parts("tank2", "tanks")
    ({'sensor:theta'}, {'x'}, {'h2'})
    """
    numbers = _numbers(model)
    found = set()
    for part in site.split("+"):
        kind, _, name = part.rpartition(":")
        found.add(f"{kind}:{numbers.get(name, name)}" if kind else numbers.get(name, name))
    return found


@cache
def _numbers(model: str) -> dict[str, str]:
    """The model's variable for each name that counts places."""
    machine = MACHINES[model]
    command = dict.fromkeys(["command"], next(iter(machine.inputs), ""))
    if model == "cart":
        return {"joint1": "theta", "q1": "theta", "slide1": "x", "x1": "x", **command}
    names = {f"{kind}{k}": name for k, name in enumerate(machine.outputs, 1) for kind in ("joint", "q", "tank")}
    return names if model == "arm" else {**names, **command}


def same_site(true: str, said: str, model: str) -> bool:
    """Tell whether a diagnosis points at the place; it may fit an effect at more joints than those that have it."""
    return site_parts(true, model) <= site_parts(said, model)


def parameter_errors(true: Mapping[str, Any], said: Mapping[str, Any]) -> list[tuple[float, bool]]:
    """Error of each parameter that truth and diagnosis name alike, and whether the 90 % interval covers the truth.

    Errors are shares of the true departure from the value at which the effect is absent.
    """
    found = []
    for name, value in true.items():
        if name in ("effect", "site") or name not in said:
            continue
        absent = 1.0 if true["effect"] == "force_sensor_gain" else _ABSENT.get(name.split("[")[0], 0.0)
        size = abs(value - absent)
        if size > 0:
            low, high = said[name]["ci90"]
            found.append((abs(said[name]["value"] - value) / size, low <= value <= high))
    return found
