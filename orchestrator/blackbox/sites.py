"""Where effects can be attached to an FMU, and how large things are there."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import cumulative_trapezoid

from fmus.symbolic.system import Variable
from orchestrator.blackbox.library import Scales
from orchestrator.blackbox.ports import FORCE_UNITS, Description, Port
from orchestrator.blackbox.worker import Probe, Wiring
from orchestrator.measurements import BoundSet
from orchestrator.models.smoothing import SmoothedTrial

NEGLIGIBLE = 1e-7
# Times of effects suit plants that are sampled at this interval in s or a shorter one.
QUICK = 0.01
# Parameters of an FMU that are looked at.
MOST_PARAMETERS = 24


@dataclass(frozen=True)
class Position:
    """An output that reads a state: output = slope * state + offset; der(state) is the state `speed`, or None."""

    state: int
    speed: int | None
    slope: float
    offset: float


@dataclass(frozen=True)
class ForceSite:
    """An input of the FMU that acts as a force on an output; `position` and `speed` count sensed values.

    `gain` is the acceleration for a unit of the force. The output may be a speed; if nothing shows its position, `position` is it, too.
    """

    input: int
    output: int
    position: int
    speed: int
    gain: float

    @property
    def sign(self) -> float:
        """1, or -1 for an input that pushes against the direction in which the output counts; effects act in that direction."""
        return math.copysign(1.0, self.gain)


@dataclass(frozen=True)
class Sites:
    """Inputs, outputs and states of an FMU as scalars, how they are wired, and the sites of effects.

    `driven` and `measured` are the numbers of the inputs and outputs that have a column in the data; scales belong to
    them one by one. `positions` maps an output to what it reads. `sensed_names` are the variables behind the sensed
    values, empty for a rate that the FMU does not show. `parameters` are those of an FMU that is stepped which may be wrong; where
    rates are told, they are looked at there.
    """

    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    states: tuple[Variable, ...]
    wiring: Wiring
    driven: tuple[int, ...] = ()
    measured: tuple[int, ...] = ()
    forces: tuple[ForceSite, ...] = ()
    force_scales: Scales = field(default_factory=lambda: Scales({}, {}, (0.0, 1.0)))
    input_scales: tuple[Scales, ...] = ()
    output_scales: tuple[Scales, ...] = ()
    positions: Mapping[int, Position] = field(default_factory=dict)
    sensed_names: tuple[str, ...] = ()
    parameters: tuple[Port, ...] = ()

    @property
    def n_sensed(self) -> int:
        """Number of sensed values."""
        return self.wiring.n_sensed + len(self.wiring.differenced)

    @property
    def shows_positions(self) -> bool:
        """Whether a position is shown where each force acts."""
        return all(force.position != force.speed for force in self.forces)

    @property
    def one_force_each(self) -> bool:
        """Whether each force acts on its own output, so that all can be fitted together."""
        outputs = [force.output for force in self.forces]
        return len(set(outputs)) == len(outputs)


def wired(ports: Sequence[Port]) -> tuple[tuple[int, ...], int, dict[str, int]]:
    """References to ask for, the number of scalars they give, and the place of each port among them."""
    places: dict[str, int] = {}
    references: dict[int, int] = {}
    total = 0
    for port in ports:
        if port.reference not in references:
            references[port.reference] = total
            total += port.size
        places[port.name] = references[port.reference] + port.place
    return tuple(references), total, places


def plain_sites(description: Description) -> Sites:
    """The FMU alone, without places for effects."""
    inputs, n_inputs, _ = wired(description.inputs)
    outputs, n_outputs, _ = wired(description.outputs)
    return Sites(
        inputs=tuple(port.variable for port in description.inputs),
        outputs=tuple(port.variable for port in description.outputs),
        states=tuple(p.variable for p in (description.settable if description.cosimulation else description.states)),
        wiring=Wiring(inputs, n_inputs, (), 0, (), outputs, n_outputs),
    )


def find_positions(probe: Probe, outputs: np.ndarray, states: np.ndarray) -> dict[int, Position]:
    """Outputs that read one state, and the state that is its rate, from Jacobians taken at `states` with these `outputs`.

    Args:
        probe: Jacobians of rates and outputs at one point.
        outputs: values of the outputs there.
        states: values of the states there.

    Returns:
        Positions by the number of the output, from 0.
    """
    found = {}
    for k, row in enumerate(probe.outputs_by_states):
        state = _single(row)
        if state is None or np.any(np.abs(probe.outputs_by_inputs[k]) > NEGLIGIBLE):
            continue
        speed = _single(probe.rates_by_states[state])
        if speed is not None and abs(probe.rates_by_states[state, speed] - 1) > 1e-5:
            speed = None
        slope = float(row[state])
        found[k] = Position(state, speed, slope, float(outputs[k] - slope * states[state]))
    return found


def find_sites(
    description: Description,
    data: BoundSet,
    positions: Mapping[int, Position],
    gains: np.ndarray,
    speeds: Collection[int] = (),
) -> Sites:
    """Find where effects attach, for one set of data.

    Args:
        description: the FMU.
        data: the trials.
        positions: outputs that read one state, by their numbers.
        gains: (outputs, inputs) acceleration for a unit of each input, 0 where it is no force on that output.
        speeds: numbers of outputs that are speeds.
    """
    plain = plain_sites(description)
    input_names, output_names = ([v.name for v in part] for part in (plain.inputs, plain.outputs))
    driven = tuple(i for i, name in enumerate(input_names) if _varies(data, i) and name not in data.unconnected_inputs)
    measured = tuple(output_names.index(name) for name in data.output_names)
    position_of = {
        description.speed_of[port.name].name: port for port in description.outputs if port.name in description.speed_of
    }
    own = {k: position_of[output_names[k]] for k in speeds if output_names[k] in position_of}
    # Of a position and its speed, both measured, the position shows all that the speed does.
    alone = [k for k in measured if k not in own or output_names.index(own[k].name) not in measured]
    pairs = _pairs(plain, gains, alone, {input_names.index(name) for name in data.unconnected_inputs}, speeds)
    shown = [own.get(k, description.outputs[k]) for _, k in pairs]
    rates = [description.outputs[k] if k in speeds else _speed_port(description, positions, k) for _, k in pairs]
    sensed, n_sensed, places = wired([*shown, *(port for port in rates if port is not None)])
    named = {place: name for name, place in places.items()}
    differenced: list[int] = []
    forces = []
    for (i, k), place, port in zip(pairs, shown, rates, strict=True):
        position = places[place.name]
        if port is None:
            differenced.append(position)
            speed = n_sensed + len(differenced) - 1
        else:
            speed = places[port.name]
        forces.append(ForceSite(i, k, position, speed, float(gains[k, i])))
    outputs, n_outputs = plain.wiring.outputs, plain.wiring.n_outputs
    wiring = Wiring(
        plain.wiring.inputs, plain.wiring.n_inputs, sensed, n_sensed, tuple(differenced), outputs, n_outputs
    )
    seconds = {"s": max(1.0, float(np.median(np.diff(data.trials[0].time))) / QUICK)}
    trials = [SmoothedTrial(t.time, t.inputs, t.outputs, np.array(list(_noise(data)))) for t in data.learning]
    return Sites(
        inputs=plain.inputs,
        outputs=plain.outputs,
        states=plain.states,
        wiring=wiring,
        driven=driven,
        measured=measured,
        forces=tuple(forces),
        force_scales=_force_scales(plain, forces, measured, speeds, trials),
        input_scales=tuple(
            _signal_scales("input", plain.inputs[i], [t.inputs[:, i] for t in trials], seconds) for i in driven
        ),
        output_scales=tuple(
            _signal_scales("output", plain.outputs[k], [t.measured[:, m] for t in trials], seconds)
            for m, k in enumerate(measured)
        ),
        positions=dict(positions),
        parameters=_that_may_be_wrong(description),
        sensed_names=tuple(named.get(place, "") for place in range(n_sensed + len(differenced))),
    )


def _that_may_be_wrong(description: Description) -> tuple[Port, ...]:
    """Parameters of an FMU that is stepped, at most so many as are looked at in model exchange."""
    return tuple(p for p in description.parameters if p.variable.start and description.cosimulation)[:MOST_PARAMETERS]


def _single(row: np.ndarray) -> int | None:
    """Position of the only entry that is not negligible."""
    big = np.flatnonzero(np.abs(row) > NEGLIGIBLE * max(1.0, float(np.abs(row).max(initial=0.0))))
    return int(big[0]) if big.size == 1 else None


def _varies(data: BoundSet, i: int) -> bool:
    return any(np.ptp(trial.inputs[:, i]) > 0 for trial in data.trials)


def _noise(data: BoundSet) -> list[float]:
    return [data.noise_std[name] for name in data.output_names]


def _pairs(
    plain: Sites, gains: np.ndarray, measured: Sequence[int], unconnected: set[int], speeds: Collection[int]
) -> list[tuple[int, int]]:
    """Inputs that act as forces on measured outputs: by name where possible, else all that fit by unit."""
    pairs = []
    for k in measured:
        per = "/s" if k in speeds else ""
        acting = [i for i in range(len(plain.inputs)) if gains[k, i]]
        fitting = [i for i in acting if _conjugate(plain.inputs[i], plain.outputs[k], per)]
        by_name = [i for i in fitting if _mentions(plain.inputs[i].name, plain.outputs[k].name)]
        free = [i for i in fitting if i in unconnected]
        pairs += [(i, k) for i in (by_name[:1] or free or fitting)]
    return pairs


def _conjugate(force: Variable, moved: Variable, per: str) -> bool:
    """Whether a force's unit times that of a position, or of a speed (`per` is "/s"), is an energy or a power; one that is not
    declared fits."""
    if not force.unit:
        return not moved.unit or moved.unit in {unit + per for unit in FORCE_UNITS.values()}
    return force.unit in FORCE_UNITS and moved.unit in ("", FORCE_UNITS[force.unit] + per)


def _mentions(force: str, position: str) -> bool:
    """Whether an input's name says that it acts on an output; of a coupled system both are in the same component."""
    component, _, inside = position.partition(".")
    if inside and force.startswith(f"{component}."):
        force, position = force.removeprefix(f"{component}."), inside
    return (
        re.search(rf"(?<![a-z0-9]){re.escape(position.lower())}(?![a-z0-9])", force.lower().replace("_", " "))
        is not None
    )


def _speed_port(description: Description, positions: Mapping[int, Position], k: int) -> Port | None:
    """A variable that is the speed of an output: the state that is its rate, or one declared as its derivative."""
    position = positions.get(k)
    if position is not None and position.speed is not None and abs(position.slope - 1) < 1e-6:
        return description.states[position.speed]
    return description.speed_of.get(description.outputs[k].name)


def _force_scales(
    plain: Sites,
    forces: Sequence[ForceSite],
    measured: Sequence[int],
    speeds: Collection[int],
    trials: Sequence[SmoothedTrial],
) -> Scales:
    """Sizes over all force sites: the force that the measured acceleration takes, speed, and range of position."""
    if not forces:
        return Scales({}, {}, (0.0, 1.0))
    size, speed, low, high = 0.0, 0.0, np.inf, -np.inf
    for site in forces:
        m = list(measured).index(site.output)
        if site.output in speeds:
            accelerations, rates = (
                [part[:, m] for part in parts] for parts in zip(*((t.speeds, t.values) for t in trials), strict=True)
            )
            values = np.concatenate(
                [cumulative_trapezoid(r, t.time, initial=0.0) for r, t in zip(rates, trials, strict=True)]
            )
        else:
            accelerations = [t.smoother(t.accelerations)[:, m] for t in trials]
            rates, values = [t.speeds[:, m] for t in trials], np.concatenate([t.values[:, m] for t in trials])
        size = max(size, _rms(accelerations) / abs(site.gain))
        speed = max(speed, _rms(rates))
        low, high = min(low, float(values.min())), max(high, float(values.max()))
    force, moved = plain.inputs[forces[0].input].unit, plain.outputs[forces[0].output].unit
    position = moved.removesuffix("/s") if forces[0].output in speeds else moved
    half = max(0.5 * (high - low), 1e-9)
    sizes = {"force": size or 1.0, "speed": speed or 1.0, "position": half}
    units = {"force": force or "1", "position": position or "1", "speed": f"{position or '1'}/s"}
    return Scales(sizes, units, (0.5 * (low + high), half))


def _rms(parts: Sequence[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


def _signal_scales(kind: str, variable: Variable, series: Sequence[np.ndarray], seconds: Mapping[str, float]) -> Scales:
    """Size of a signal: its largest magnitude for an input, its spread for an output."""
    values = np.concatenate(series)
    size = float(np.abs(values).max()) if kind == "input" else float(np.std(values))
    return Scales({kind: size or 1.0, **seconds}, {kind: variable.unit or "1"}, (0.0, 1.0))
