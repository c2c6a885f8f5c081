"""Cases that reach what is not covered: candidates are run, and those that reach something new are proposed."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from orchestrator.cosim.component import Port
from orchestrator.cosim.system import Value
from orchestrator.measurements.toml_values import toml_literal, toml_pairs
from orchestrator.regress.case import Case, Stimulus
from orchestrator.regress.coverage import ModelCoverage, cover, ports_of
from orchestrator.regress.outcome import Outcome

_MOST_CANDIDATES = 120
# Levels of inputs as multiples of their size, where nothing is declared about their range.
_LEVELS = (1.0, -1.0, 0.1, 10.0, -10.0, 100.0)


@dataclass(frozen=True)
class Suggestion:
    """A case that reaches `goals`, with its inputs and parameters."""

    name: str
    goals: tuple[str, ...]
    inputs: Mapping[str, Mapping[str, Any]]
    parameters: Mapping[str, float]
    stop: float

    @property
    def text(self) -> str:
        """The case as TOML, to be put into a case file."""
        lines = [
            f"# reaches {', '.join(self.goals)}",
            "[[case]]",
            f'name = "{self.name}"',
            f"run = {{ stop = {self.stop:g} }}",
        ]
        if self.parameters:
            lines.append(f"parameters = {toml_literal(self.parameters)}")
        if self.inputs:
            lines += ["[case.inputs]", *toml_pairs(self.inputs)]
        return "\n".join(lines)

    def to_json(self) -> dict[str, Any]:
        """The suggestion as plain data."""
        inputs = {name: dict(wave) for name, wave in self.inputs.items()}
        return {
            "name": self.name,
            "reaches": list(self.goals),
            "inputs": inputs,
            "parameters": dict(self.parameters),
            "toml": self.text,
        }


def suggestions(model: ModelCoverage, run: Callable[[Sequence[Case]], Sequence[Outcome]]) -> list[Suggestion]:
    """Propose as few cases as reach as much as was found.

    Args:
        model: what is covered already.
        run: runs cases and says what they reach.
    """
    left = set(model.goals)
    if not left:
        return []
    base, stop = model.cases[0], _stop(model)
    candidates = list(_candidates(model, base, stop))[:_MOST_CANDIDATES]
    gains: list[tuple[Case, set[str]]] = []
    for case, outcome in zip(candidates, run(candidates), strict=True):
        if outcome.coverage:
            (alone,) = cover([case], [outcome])
            gains.append((case, left - alone.goals))
    found: list[Suggestion] = []
    while gains:
        case, best = max(gains, key=lambda gain: len(gain[1] & left))
        best &= left
        if not best:
            break
        left -= best
        found.append(_told(case, tuple(sorted(best)), stop, len(found) + 1))
    return found


def _stop(model: ModelCoverage) -> float:
    stops = [case.stop for case in model.cases if case.stop]
    return max(stops, default=model.description.stop_time or 1.0)


def _candidates(model: ModelCoverage, base: Case, stop: float) -> Iterator[Case]:
    """Parameters together and one at a time, a longer run, inputs one at a time and together; only what goals ask for."""
    path = str(model.description.path.resolve())
    plain = replace(
        base, model=path, signals={}, reference=None, checks={}, stimulus=Stimulus(), parameters={}, stop=stop
    )
    if any(goal.startswith("parameter") for goal in model.goals):
        yield from _with_parameters(plain, ports_of(model.description, "parameter"))
    if all(goal.startswith("parameter") for goal in model.goals):
        return
    yield replace(plain, stop=4.0 * stop)
    inputs = ports_of(model.description, "input")
    waves = {port.name: _waves(port, stop) for port in inputs if not port.shape}
    for name, several in waves.items():
        for wave in several:
            yield replace(plain, stimulus=Stimulus(signals={name: wave}))
    for k in range(max(map(len, waves.values()), default=0)):
        together = {name: several[k % len(several)] for name, several in waves.items()}
        yield replace(plain, stimulus=Stimulus(signals=together))
        yield replace(plain, stimulus=Stimulus(signals=together), stop=4.0 * stop)


def _with_parameters(plain: Case, ports: Sequence[Port]) -> Iterator[Case]:
    values = {port.name: several for port in ports if (several := _values(port))}
    for place in (0, -1):
        yield replace(plain, parameters={name: Value(several[place]) for name, several in values.items()})
    for name, several in values.items():
        for value in several:
            yield replace(plain, parameters={name: Value(value)})


def _values(port: Port) -> list[float]:
    start = float(port.start or 0.0) if not port.shape else 0.0
    wanted = [0.5 * start, 2.0 * start] if start else [1.0, -1.0]
    limits = [limit for limit in (port.minimum, port.maximum) if limit is not None and abs(limit) < 1e30]
    low = -float("inf") if port.minimum is None else port.minimum
    high = float("inf") if port.maximum is None else port.maximum
    return [] if port.shape else [float(v) for v in dict.fromkeys((*wanted, *limits)) if low <= v <= high]


def _waves(port: Port, stop: float) -> list[dict[str, Any]]:
    start = float(port.start or 0.0)
    if port.minimum is not None and port.maximum is not None:
        levels = [port.maximum, port.minimum, 0.5 * (port.minimum + port.maximum)]
    else:
        size = abs(port.nominal or 0.0) or abs(start) or 1.0
        levels = [start + size * level for level in _LEVELS]
        levels = [min(max(v, _or(port.minimum, v)), _or(port.maximum, v)) for v in levels]
    found: list[dict[str, Any]] = []
    for level in dict.fromkeys(levels):
        if level != start:
            found.append({"kind": "step", "at": 0.1 * stop, "from": start, "to": level})
            found.append({"kind": "pulse", "at": 0.1 * stop, "width": 0.3 * stop, "from": start, "to": level})
    return found


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value


def _told(case: Case, goals: tuple[str, ...], stop: float, number: int) -> Suggestion:
    parameters = {name: float(value.value) for name, value in case.parameters.items()}
    return Suggestion(f"suggested {number}", goals, dict(case.stimulus.signals), parameters, case.stop or stop)
