"""A block that learns during a run from what is seen of its outputs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from orchestrator.cosim.component import Port, StepEnd
from orchestrator.gp.block import Block, Output
from orchestrator.gp.block_component import GpComponent
from orchestrator.gp.observations import observe
from orchestrator.gp.online import Learner
from orchestrator.measurements.toml_values import number
from orchestrator.measurements.wording import listed, shown

SEEN = "_seen"
_FORGET = ("least informative", "oldest")
# Standard deviations; of sound data one in a thousand million is farther off.
GATE = 6.0


class LearningGp(GpComponent):
    """Predicts as a block does and learns at each of its steps, from inputs `tau_seen` beside the outputs `tau`.

    What is learned are the inputs at the begin of the step. A step of the component's own, such as 10 ms, keeps data
    apart. Data are kept on not more than `budget` rows, `noise` is the standard deviation of what is seen, in the unit
    of the outputs. Without `forget` rows hold the information of all data; with "least informative" or "oldest" whole
    data are forgotten. What is off by more than `gate` standard deviations (6 if absent) is doubted, see `Learner`. It
    does not go back in time.
    """

    can_save = False

    def write_fmu(self, path: Path) -> None:
        """An FMU of it would keep to what it knew at first."""
        raise MisfitError(
            "it learns while it runs, which an FMU does not; leave learn out, so that it keeps what it knows"
        )

    def __init__(self, block: Block, settings: Any) -> None:
        super().__init__(block)
        chosen = _settings(settings)
        self._noise = chosen.noise
        rows = block.posterior.rows
        components = block.posterior.weights.shape[1]
        self._groups = _groups(block.outputs, components)
        self._learner = Learner(
            block.posterior.latents,
            rows.inputs.shape[1],
            components,
            chosen.budget,
            forgets_oldest=chosen.forget == _FORGET[1],
            compresses=chosen.forget is None,
            gate=chosen.gate,
        )
        for each in block.observations:
            self._learner.add(each)
        seen = [Port(o.name + SEEN, "input", unit=o.unit, start=0.0, description="to learn") for o in block.outputs]
        self._values.update(dict.fromkeys((port.name for port in seen), 0.0))
        self.ports = (*self.ports, *seen)
        self._use()

    def step(self, time: float, size: float) -> StepEnd:
        """Learn what is seen now; outputs follow from it at the step's end."""
        for group in self._groups:
            of = self.block.coefficients(group[0], self._values)
            values = [[self._values[output.name + SEEN] for output in group]]
            self._learner.add(observe(f"t = {time:.9g} s", self.block.point(self._values), of, values, self._noise))
        self._use()
        return super().step(time, size)

    def _use(self) -> None:
        self.block = replace(self.block, posterior=self._learner.live())


@dataclass(frozen=True)
class _Settings:
    """What the option `learn` says."""

    budget: int
    noise: float
    forget: str | None
    gate: float


def _settings(given: Any) -> _Settings:
    known = isinstance(given, dict) and {"budget", "noise"} <= set(given) <= {"budget", "noise", "forget", "gate"}
    found = given if known else {}
    budget, noise = found.get("budget"), number(found.get("noise"))
    forget, gate = found.get("forget"), number(found.get("gate", GATE))
    if isinstance(budget, bool) or not isinstance(budget, int) or budget < 1 or noise is None or noise <= 0.0:
        raise MisfitError(
            f"learn = {shown(given)}; expected {{ budget = ..., noise = ... }}, a number of data and a standard deviation above 0"
        )
    if forget is not None and forget not in _FORGET:
        raise MisfitError(f"learn: forget = {shown(forget)}; expected one of {listed(_FORGET)}")
    if gate is None or gate <= 0.0:
        raise MisfitError(f"learn: gate = {shown(found.get('gate'))}; expected a number of standard deviations above 0")
    return _Settings(budget, noise, forget, gate)


def _groups(outputs: Sequence[Output], components: int) -> list[list[Output]]:
    """Outputs that are the components of one combination, in order; only all of them together are an observation."""
    groups: dict[Any, list[Output]] = {}
    for output in outputs:
        groups.setdefault(output.terms, []).append(output)
    for group in groups.values():
        group.sort(key=lambda output: output.component)
        if [output.component for output in group] != list(range(components)):
            raise MisfitError(
                f"{group[0].name} is learned only with all {components} components of its functions; add outputs for the others"
            )
    return list(groups.values())
