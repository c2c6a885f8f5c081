"""An FMU where the diagnosis expects the source of a model: its candidates, and its extension with effects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import TypeAlias

import numpy as np

from fmus.catalogue import ModelicaModel
from fmus.symbolic.system import SymbolicSystem
from orchestrator.blackbox.coupled import CoupledSystem, Mounted, couple
from orchestrator.blackbox.fmu_file import FmuFile
from orchestrator.blackbox.library import FORCE_SLOTS, INPUT_SLOTS, PARAMETER_SLOT, Law, Scales, laws
from orchestrator.blackbox.model import CoupledModel
from orchestrator.blackbox.ports import FORCE_UNITS, Port
from orchestrator.blackbox.sites import NEGLIGIBLE, Sites, find_sites, plain_sites
from orchestrator.blackbox.system_source import open_file
from orchestrator.library.cards import Candidate
from orchestrator.measurements import BoundSet, MeasurementSet, bind

PULSE_SAMPLES = 24
# An output is the rate of another one if its steps differ from what it adds up to by less than this share of the largest.
RATE_AGREES = 0.02


@dataclass(frozen=True)
class FmuSource:
    """A black-box FMU with the sites that it offers for one set of data: what is diagnosed where there is no Modelica class.

    `name` is the path as it was given, `class_name` the stem of the file; `held` names inputs that stay at a sample's value
    until the next one.
    """

    name: str
    class_name: str
    file: Path
    fmu: FmuFile
    sites: Sites
    held: tuple[str, ...] = ()
    measurements: MeasurementSet | None = field(default=None, compare=False, repr=False)

    @staticmethod
    def prepare(path: Path, measurements: MeasurementSet, *, stepped: bool = False) -> "FmuSource":
        """Look at an FMU and at the data that it is to explain.

        Args:
            path: the FMU.
            measurements: the trials.
            stepped: whether it is stepped in co-simulation although it offers model exchange.

        Raises:
            MisfitError: if the file is no FMU that can be run, or the data do not fit it.
            ComponentError: if it fails.
        """
        fmu = open_file(path, stepped=stepped, join_forces=True)
        plain = plain_sites(fmu.started)
        data = bind(measurements, plain.inputs, plain.outputs)
        answers = _answers(fmu, data)
        description = replace(fmu.started, speed_of={**fmu.started.speed_of, **answers.speed_of})
        sites = find_sites(description, data, fmu.positions(), answers.gains, answers.speeds)
        sites = replace(sites, parameters=_that_show(fmu, sites, data))
        return FmuSource(
            name=str(path), class_name=path.stem, file=path, fmu=fmu, sites=sites, measurements=measurements
        )

    def compile(self) -> CoupledSystem:
        """The FMU alone."""
        return self.coupled(())

    def coupled(self, mounted: Sequence[Mounted]) -> CoupledSystem:
        """The FMU with effects."""
        return couple(self.name, self.sites, mounted)

    def model(
        self, system: SymbolicSystem, signals: Sequence[str] | None = None, free: Sequence[str] = ()
    ) -> CoupledModel:
        """A coupled system of this FMU as a model."""
        assert isinstance(system, CoupledSystem)
        return CoupledModel(self.name, system, self.fmu, self.sites, signals, free, self.held)

    def candidates(self) -> list[Candidate]:
        """Every effect at every site where it can be attached, with its card in the FMU's units."""
        found = []
        for law in laws():
            names, scales = self._places(law)
            slot = law.card.slots[0]
            if law.card.elements == "together" and names and self._fit_together(law):
                found.append(Candidate(law.sized(scales[0]), slot, "", "+".join(names)))
            else:
                found += [
                    Candidate(law.sized(scale), slot, f"[{k}]", name)
                    for k, (name, scale) in enumerate(zip(names, scales, strict=True), start=1)
                ]
        return found

    def mounted(self, candidates: Sequence[Candidate]) -> list[Mounted]:
        """Candidates as laws in slots."""
        by_id = {law.card.id: law for law in laws()}
        places: dict[tuple[str, str], list[int]] = {}
        for candidate in candidates:
            law = by_id[candidate.card.id]
            every = range(1, len(self._places(law)[0]) + 1)
            numbers = [int(candidate.element.strip("[]"))] if candidate.element else list(every)
            places.setdefault((candidate.slot, law.card.id), []).extend(numbers)
        return [Mounted(by_id[card_id], slot, tuple(sorted(numbers))) for (slot, card_id), numbers in places.items()]

    def refusals(self) -> tuple[str, ...]:
        """One line for each reason why effects cannot be attached: what the FMU would have to expose."""
        lacking: dict[str, list[str]] = {}
        for law in laws():
            if not self._places(law)[0] and self._may_act(law):
                lacking.setdefault(self._lacking(law), []).append(law.card.id)
        return tuple(
            f"{', '.join(ids)} {'is' if len(ids) == 1 else 'are'} not tried: {reason}"
            for reason, ids in lacking.items()
        )

    def _places(self, law: Law) -> tuple[tuple[str, ...], tuple[Scales, ...]]:
        """Names of the sites where a law can act, and the sizes of things there."""
        sites = self.sites
        slot = law.card.slots[0]
        if slot == PARAMETER_SLOT:
            return tuple(p.name for p in sites.parameters), (Scales({}, {}, (0.0, 1.0)),) * len(sites.parameters)
        if slot in FORCE_SLOTS:
            if law.needs_position and not sites.shows_positions:
                return (), ()
            names = [sites.outputs[force.output].name for force in sites.forces]
            if not sites.one_force_each:
                names = [f"{sites.inputs[f.input].name}->{sites.outputs[f.output].name}" for f in sites.forces]
            return tuple(names), (sites.force_scales,) * len(names)
        if slot in INPUT_SLOTS:
            return tuple(sites.inputs[i].name for i in sites.driven), sites.input_scales
        return tuple(f"sensor:{sites.outputs[k].name}" for k in sites.measured), sites.output_scales

    def _fit_together(self, law: Law) -> bool:
        return law.card.slots[0] not in FORCE_SLOTS or self.sites.one_force_each

    def _may_act(self, law: Law) -> bool:
        """Whether a law makes sense for an FMU of this kind: friction needs something that moves."""
        slot = law.card.slots[0]
        if slot in FORCE_SLOTS:
            moved = {"", *FORCE_UNITS.values(), *(unit + "/s" for unit in FORCE_UNITS.values())}
            return any((self.sites.outputs[k].unit or "") in moved for k in self.sites.measured)
        return slot != PARAMETER_SLOT or self.fmu.started.cosimulation

    def _lacking(self, law: Law) -> str:
        """What is missing for a law without a site."""
        if law.card.slots[0] == PARAMETER_SLOT:
            return "the FMU would have to expose parameters that can be set before a run"
        outputs = " or ".join(self.sites.outputs[k].name for k in self.sites.measured)
        if law.card.slots[0] in FORCE_SLOTS:
            if self.sites.forces:
                return f"the FMU would have to expose the position to {outputs}"
            return f"the FMU would have to expose an input that acts as a force (N or N.m) on {outputs}"
        return "no input of the FMU is driven by the data"


# What can be compared, diagnosed and extended.
Source: TypeAlias = ModelicaModel | FmuSource


@dataclass(frozen=True)
class _Answers:
    """How outputs answer inputs: `gains` (outputs, inputs) are accelerations for a unit of each input, 0 where it is no force;
    `speeds` are the numbers of outputs that are speeds, `speed_of` outputs that are the rates of others."""

    gains: np.ndarray
    speeds: frozenset[int] = frozenset()
    speed_of: Mapping[str, Port] = field(default_factory=dict)


def _answers(fmu: FmuFile, data: BoundSet) -> _Answers:
    description = fmu.started
    if description.cosimulation:
        return _answers_to_pulses(fmu, data)
    gains = np.zeros((len(description.outputs), len(description.inputs)))
    if description.states:
        probe = fmu.probe()
        for k, position in fmu.positions().items():
            if position.speed is not None:
                gains[k] = position.slope * probe.rates_by_inputs[position.speed]
    return _Answers(np.where(np.abs(gains) > NEGLIGIBLE * max(np.abs(gains).max(initial=0.0), 1e-30), gains, 0.0))


def _answers_to_pulses(fmu: FmuFile, data: BoundSet) -> _Answers:
    """The same from short simulations: a position answers a steady force with gain t^2/2, a speed with gain t.

    What grows in proportion to time may be a temperature: a speed says so by its unit, or is the rate of another output.
    """
    sites, ports = plain_sites(fmu.started), fmu.started.outputs
    model = CoupledModel(fmu.path.name, couple(fmu.path.name, sites, ()), fmu, sites)
    trial = data.trials[0]
    time, inputs = trial.time[:PULSE_SAMPLES], trial.inputs[:PULSE_SAMPLES]
    start = np.array([0.0 if v.start is None else v.start for v in sites.states])
    compiled = model.compiled
    plain = compiled.run(time, inputs, compiled.parameters, start).outputs
    positions, rates = (np.zeros((len(ports), len(sites.inputs))) for _ in range(2))
    speed_of: dict[str, Port] = {}
    for i in range(len(sites.inputs)):
        pushed = inputs.copy()
        pushed[:, i] += max(float(np.abs(trial.inputs[:, i]).max()), 1.0)
        size = float(pushed[0, i] - inputs[0, i])
        answer = (compiled.run(time, pushed, compiled.parameters, start).outputs - plain) / size
        for k in range(len(ports)):
            positions[k, i] = _growth(time - time[0], answer[:, k], 2)
            rates[k, i] = _growth(time - time[0], answer[:, k], 1)
        for k, j in product(range(len(ports)), repeat=2):
            if positions[k, i] and rates[j, i] and _is_rate(time, answer[:, k], answer[:, j]):
                speed_of[ports[k].name] = ports[j]
    of_others = {port.name for port in speed_of.values()}
    named = {unit + "/s" for unit in FORCE_UNITS.values()}
    speeds = frozenset(
        k for k, port in enumerate(ports) if rates[k].any() and (port.variable.unit in named or port.name in of_others)
    )
    positions[sorted(speeds)] = rates[sorted(speeds)]
    return _Answers(positions, speeds, speed_of)


def _that_show(fmu: FmuFile, sites: Sites, data: BoundSet) -> tuple[Port, ...]:
    """The parameters of which the outputs would show a value twice as large, by slopes: not the tolerances of an FMU's solver."""
    if not sites.parameters:
        return ()
    law = next(law for law in laws() if law.card.slots[0] == PARAMETER_SLOT)
    names = [sites.outputs[k].name for k in sites.measured]
    system = couple(fmu.path.name, sites, [Mounted(law, PARAMETER_SLOT, tuple(range(1, len(sites.parameters) + 1)))])
    shares = [v.name for v in system.parameters]
    compiled = CoupledModel(fmu.path.name, system, fmu, sites, names, shares).compiled
    start = np.array([0.0 if v.start is None else v.start for v in system.states])
    noise, shown = np.array([data.noise_std[name] for name in names]), np.zeros(len(shares), dtype=bool)
    for trial in data.learning:
        run = compiled.run(trial.time, trial.inputs, compiled.parameters, start, sensitivities=True)
        assert run.sensitivities is not None
        slopes = run.sensitivities[:, :, len(start) :]
        shown |= np.any(np.sqrt(np.mean(slopes**2, axis=0)) > noise[:, None], axis=0)
    return tuple(port for port, yes in zip(sites.parameters, shown, strict=True) if yes)


def _is_rate(time: np.ndarray, answer: np.ndarray, other: np.ndarray) -> bool:
    """Whether one answer to a step is the rate of another one.

    >>> time = np.linspace(0, 1, 24)
    >>> _is_rate(time, time**2 / 2, time), _is_rate(time, time**2 / 2, 2 * time), _is_rate(time, time**2 / 2, time**2 / 2)
    (True, False, False)
    """
    steps = np.diff(time)
    added = 0.5 * (other[1:] + other[:-1]) * steps
    return bool(np.abs(np.diff(answer) - added).max() < RATE_AGREES * np.abs(added).max())


def _growth(time: np.ndarray, answer: np.ndarray, power: int) -> float:
    """Acceleration behind a step answer that grows as this power of time; 0 if it does not.

    >>> time = np.linspace(0, 1, 24)
    >>> _growth(time, 1.5 * time**2, 2), _growth(time, 3 * time, 1), _growth(time, 3 * time, 2)
    (3.0, 3.0, 0.0)
    """
    later = slice(2, None)
    if np.any(answer[later] == 0) or np.any(np.sign(answer[later]) != np.sign(answer[-1])):
        return 0.0
    slope = np.polyfit(np.log(time[later]), np.log(np.abs(answer[later])), 1)[0]
    early = slice(2, 8)
    return float(np.mean(power * answer[early] / time[early] ** power)) if abs(slope - power) < 0.4 else 0.0


def fmu_model(path: Path, *, stepped: bool = False, name: str = "") -> CoupledModel:
    """An FMU alone, to be compared with any data; `name` is what it is called, by default as its file.

    Raises:
        FmuError: if the file is no FMU that can be run.
        ComponentError: if it fails while it is looked at.
    """
    fmu = open_file(path, stepped=stepped)
    sites = replace(plain_sites(fmu.started), positions=fmu.positions())
    called = name or path.name
    return CoupledModel(called, couple(called, sites, ()), fmu, sites)
