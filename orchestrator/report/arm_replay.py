"""The worst trial of an arm as a replay: measured and modelled arm, with the torque that the model lacks at the joints."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from fmus.errors import MisfitError
from orchestrator.compare.result import Comparison, TrialCurves
from orchestrator.measurements import BoundSet, MeasurementSet, bind
from orchestrator.models.contract import Model
from orchestrator.models.missing_force import Force, knows_its_forces, missing_forces
from orchestrator.models.smoothing import SmoothedTrial
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.report.arm_drawing import ArmShape, Line, Panel, Replay
from orchestrator.report.palette import Colour

ANGLES = ("q1", "q2")
JOINTS = ("shoulder", "elbow")
# A smoother over more samples takes longer than the comparison; the motion is seen as well at fewer.
MOST_SAMPLES = 2500


def worst_trial(comparison: Comparison) -> TrialCurves | None:
    """The trial with the largest error in multiples of the noise floor; None without curves."""

    def size(curves: TrialCurves) -> float:
        ratios = [
            float(np.sqrt(np.mean((curves.measured[name] - curves.modelled[name]) ** 2))) / (floor or 1.0)
            for name, floor in comparison.noise_floor.items()
            if name in curves.measured
        ]
        # A run that diverged cannot be drawn.
        return float(np.hypot.reduce(ratios)) if np.isfinite(ratios).all() else -1.0

    return max(comparison.curves, key=size, default=None)


def arm_replay(model: Model, measurements: MeasurementSet, comparison: Comparison) -> Replay | None:
    """Return the motion of the worst trial; None for a model that is no planar arm or has no measured joint angles.

    Residual torques are those of `missing_forces`, with their standard deviations; a model that does not show its forces
    gives a replay without them.

    Args:
        model: the model as given.
        measurements: the trials.
        comparison: their comparison, which says which is the worst.
    """
    trial = worst_trial(comparison)
    if trial is None or not isinstance(model, SymbolicModel) or not set(ANGLES) <= trial.measured.keys():
        return None
    shape = ArmShape.of({p.name: float(p.start) for p in model.system.parameters if p.start is not None})
    if shape is None:
        return None
    motion = replace(_motion(trial), shape=shape)
    with suppress(MisfitError):  # a smoother that breaks down leaves a replay without torques
        force = _missing(model, bind(measurements, model.inputs, model.outputs), trial)
        motion = motion if force is None else _with_torques(motion, force)
    return motion


def _motion(trial: TrialCurves) -> Replay:
    count = len(trial.time)
    angles = _columns(trial.measured, ANGLES, count)
    activations = _columns(trial.inputs, [f"alpha_{k}" for k in range(1, 7)], count)
    force = _columns(trial.inputs, ("fx", "fy"), count)
    modelled = _columns(trial.modelled, ANGLES, count)
    panels = tuple(
        Panel(
            f"{joint} angle",
            "rad",
            (
                Line("measured", Colour.MEASURED, trial.measured[name]),
                Line("model", Colour.MODEL, trial.modelled[name], dashed=True),
            ),
        )
        for joint, name in zip(JOINTS, ANGLES, strict=True)
    )
    return Replay(
        trial.time,
        angles,
        force=force if force.any() else None,
        activation=activations if activations.any() else None,
        modelled=modelled if np.isfinite(modelled).all() else None,
        panels=panels,
    )


def _columns(series: Mapping[str, np.ndarray], names: Sequence[str], count: int) -> np.ndarray:
    """Series side by side (n, names); zero where one does not move."""
    return np.column_stack([series.get(name, np.zeros(count)) for name in names])


def _missing(model: SymbolicModel, data: BoundSet, trial: TrialCurves) -> Force | None:
    """The force that the model lacks along a trial, on the joints."""
    signals = model.restricted(data.output_names)
    if not knows_its_forces(signals):
        return None
    bound = next(each for each in data.trials if (each.name, each.subset) == (trial.file, trial.set))
    noise = np.array([data.noise_std[name] for name in data.output_names])
    few = slice(None, None, -(-len(bound.time) // MOST_SAMPLES))
    smoothed = SmoothedTrial(bound.time[few], bound.inputs[few], bound.outputs[few], noise)
    return missing_forces(signals, [smoothed])[0]


def _with_torques(motion: Replay, force: Force) -> Replay:
    """The motion with residual torques and their panel, at its own times."""
    places = [force.names.index(name) for name in ANGLES]
    mean, std = (
        np.column_stack([np.interp(motion.time, force.time, part[:, place]) for place in places])
        for part in (force.mean, force.std)
    )
    colours = (Colour.RESIDUAL, Colour.FORCE)
    lines = tuple(
        Line(joint, colour, mean[:, k], std[:, k])
        for k, (joint, colour) in enumerate(zip(JOINTS, colours, strict=True))
    )
    panel = Panel("residual torque, with 90 % band", force.units[places[0]], lines)
    return replace(motion, torque=mean, torque_std=std, panels=(*motion.panels, panel))
