"""What the cases of a model reach together, and what none of them does."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmus.units import after_number
from orchestrator.cosim.component import FLOATS, Port
from orchestrator.cosim.fmu import FmuDescription, read_description
from orchestrator.measurements.wording import counted
from orchestrator.regress.case import Case
from orchestrator.regress.outcome import Outcome

# A state that moves by less than this share of its nominal value has not been exercised.
_MOVED = 1e-6


@dataclass(frozen=True)
class ModelCoverage:
    """Coverage of one FMU by its cases.

    `states` and `inputs` are lowest and highest values over all cases; `branches` (negative side, positive side) of each
    event indicator; `parameters` the values that cases gave; `cases` and `notes` what was and was not counted.
    """

    description: FmuDescription
    cases: tuple[Case, ...]
    states: Mapping[str, tuple[float, float]]
    inputs: Mapping[str, tuple[float, float]]
    branches: tuple[tuple[bool, bool], ...]
    parameters: Mapping[str, tuple[Any, ...]]
    notes: tuple[str, ...] = ()

    @property
    def goals(self) -> frozenset[str]:
        """What no case reaches: "state q", "input u", "branch 1-" and the like."""
        left = {f"state {n}" for n, (low, high) in self.states.items() if not high - low > _MOVED * self._size(n)}
        left |= {f"state {n}" for n in self.description.state_names if n not in self.states}
        left |= {f"input {port.name}" for port in ports_of(self.description, "input") if not self._is_driven(port.name)}
        for number, (negative, positive) in enumerate(self.branches, 1):
            left |= {f"branch {number}{side}" for side, seen in (("-", negative), ("+", positive)) if not seen}
        left |= {
            f"parameter {p.name}" for p in ports_of(self.description, "parameter") if p.name not in self.parameters
        }
        return frozenset(left)

    @property
    def all_goals(self) -> int:
        """How many there are."""
        inputs, parameters = ports_of(self.description, "input"), ports_of(self.description, "parameter")
        return len(self.description.state_names) + len(inputs) + 2 * len(self.branches) + len(parameters)

    def _is_driven(self, name: str) -> bool:
        return any(high > low or high != 0.0 for n, (low, high) in self.inputs.items() if n.partition("[")[0] == name)

    def _size(self, name: str) -> float:
        port = self.description.by_name[name][0]
        return abs(port.nominal) if port.nominal else 1.0

    def to_json(self) -> dict[str, Any]:
        """The coverage as plain data."""
        return {
            "model": str(self.description.path),
            "cases": [case.name for case in self.cases],
            "share": 1.0 - len(self.goals) / max(self.all_goals, 1),
            "uncovered": sorted(self.goals),
            "states": {name: list(limits) for name, limits in self.states.items()},
            "inputs": {name: list(limits) for name, limits in self.inputs.items()},
            "branches": [{"negative": low, "positive": high} for low, high in self.branches],
            "parameters": {name: [str(v) for v in values] for name, values in self.parameters.items()},
            "notes": list(self.notes),
        }


def ports_of(description: FmuDescription, causality: str) -> list[Port]:
    """Scalar and array ports of numbers that a case can drive or set."""
    return [port for port in description.ports if port.causality == causality and port.type in FLOATS]


def cover(cases: Sequence[Case], outcomes: Sequence[Outcome]) -> list[ModelCoverage]:
    """Put together what the runs of each model reached."""
    grouped: dict[str, list[tuple[Case, Mapping[str, Any]]]] = {}
    notes: list[str] = []
    for case, outcome in zip(cases, outcomes, strict=True):
        if outcome.coverage:
            grouped.setdefault(outcome.coverage["model"], []).append((case, outcome.coverage))
        else:
            notes.append(f"not counted: {outcome.reason}")
    return [_together(Path(model), found, tuple(notes)) for model, found in grouped.items()]


def _together(model: Path, found: Sequence[tuple[Case, Mapping[str, Any]]], notes: tuple[str, ...]) -> ModelCoverage:
    parts = [coverage for _, coverage in found]
    parameters: dict[str, list[Any]] = {}
    for coverage in parts:
        for name, value in coverage["parameters"].items():
            parameters.setdefault(name, []).append(value)
    count = max(len(coverage["branches"]) for coverage in parts)
    branches = [
        tuple(any(p["branches"][k][side] for p in parts if k < len(p["branches"])) for side in ("negative", "positive"))
        for k in range(count)
    ]
    return ModelCoverage(
        read_description(model),
        tuple(case for case, _ in found),
        _limits([coverage["states"] for coverage in parts]),
        _limits([coverage["inputs"] for coverage in parts]),
        tuple((low, high) for low, high in branches),
        {name: tuple(dict.fromkeys(values)) for name, values in parameters.items()},
        notes,
    )


def _limits(parts: Sequence[Mapping[str, Sequence[float]]]) -> dict[str, tuple[float, float]]:
    names = dict.fromkeys(name for part in parts for name in part)
    return {
        name: (min(p[name][0] for p in parts if name in p), max(p[name][1] for p in parts if name in p))
        for name in names
    }


def coverage_lines(model: ModelCoverage) -> list[str]:
    """The coverage of a model for people."""
    reached = model.all_goals - len(model.goals)
    lines = [
        f"coverage of {model.description.path.name} by {counted(len(model.cases), 'case')}: {reached} of {model.all_goals}"
    ]
    for name, (low, high) in (*model.states.items(), *model.inputs.items()):
        port = model.description.by_name[name.partition("[")[0] if name not in model.description.by_name else name][0]
        kind = "input" if name in model.inputs else "state"
        declared = ""
        if port.minimum is not None and port.maximum is not None and port.maximum > port.minimum:
            declared = f", {(high - low) / (port.maximum - port.minimum):.0%} of its declared range"
        lines.append(f"  {kind} {name}: {low:.4g} to {high:.4g}{after_number(port.unit)}{declared}")
    for name, values in model.parameters.items():
        lines.append(f"  parameter {name}: {', '.join(map(str, values))}{_declared(model.description, name)}")
    if model.branches:
        both = sum(low and high for low, high in model.branches)
        lines.append(f"  branches: {both} of {len(model.branches)} conditions were seen on both sides")
    lines += [f"  not reached: {goal}" for goal in sorted(model.goals)]
    return lines


def _declared(description: FmuDescription, name: str) -> str:
    if name not in description.by_name:
        return ""
    port = description.by_name[name][0]
    if port.minimum is None or port.maximum is None:
        return ""
    return f", declared {port.minimum:.4g} to {port.maximum:.4g}"
