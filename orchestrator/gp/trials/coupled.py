"""A model and its block as FMUs in a coupled system: in general, and along each held-out trial."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fmus.files import write_atomically
from fmus.package import build_fmu
from orchestrator.cosim.system import ComponentSpec, Connection, RunSettings, System, Value
from orchestrator.cosim.toml_file import write_toml
from orchestrator.gp.block import Block
from orchestrator.gp.export import block_fmu
from orchestrator.gp.trials.judged import Judgement
from orchestrator.gp.trials.places import MISSING, Place, places_of
from orchestrator.measurements import BoundTrial
from orchestrator.models.correction import PREFIX
from orchestrator.models.symbolic import SymbolicModel

STEPS = 2  # communication steps in a sample interval


def write_coupled(
    model: SymbolicModel, block: Block, judgement: Judgement | None, trials: Sequence[BoundTrial], folder: Path
) -> None:
    """Write `model.fmu`, `block.fmu`, `system.toml`, and for each trial its samples and a system that plays them.

    The model's FMU shows the states that the block needs (positions, speeds) as outputs beside its own. Inputs that
    both need, such as activations, are inputs of the system once. Along a trial the run begins where the free run did
    by which the block was judged.

    Args:
        model: the model.
        block: the block beside it.
        judgement: free runs by which the block was judged, if there are any.
        trials: the trials.
        folder: where to write; it is made if it is not there.

    Raises:
        MisfitError: without a C compiler.
        OSError: if a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    places = places_of(model, (*block.inputs, *block.factors))
    names = {name: _name(model, place) for name, place in places.items()}
    shown = [names[name] for name, place in places.items() if place.of == "state"]
    exposing = replace(model.system, outputs=tuple(dict.fromkeys((*model.system.outputs, *shown))))
    build_fmu(exposing, folder / "model.fmu")
    block_fmu(block, folder / "block.fmu")
    system = _system(model, block, places, names)
    _write(folder / "system.toml", write_toml(system))
    for trial in trials:
        stem = Path(trial.name).stem
        moving = {v.name for k, v in enumerate(model.system.inputs) if np.any(trial.inputs[:, k] != (v.start or 0.0))}
        driven = [name for name in system.inputs if name in moving]
        _write(folder / f"{stem}.csv", _samples(model, trial, driven))
        start = judgement.after.starts.get(trial.name, {}) if judgement else {}
        _write(folder / f"{stem}.toml", write_toml(_along(system, trial, stem, driven, start)))


def _system(model: SymbolicModel, block: Block, places: dict[str, Place], names: dict[str, str]) -> System:
    """Model and block, each driving the other; inputs of the system are those of the model that nothing drives."""
    missing = {PREFIX + o.name.removesuffix(MISSING): o.name for o in block.outputs}
    connections = [Connection(f"block.{output}", f"model.{name}") for name, output in missing.items()]
    connections += [
        Connection(f"model.{names[name]}", f"block.{name}") for name, place in places.items() if place.of == "state"
    ]
    inputs: dict[str, tuple[str, ...]] = {
        v.name: (f"model.{v.name}",) for v in model.system.inputs if not v.name.startswith(PREFIX)
    }
    for name, place in places.items():
        if place.of == "input":
            inputs[names[name]] = (*inputs[names[name]], f"block.{name}")
    components = {name: ComponentSpec(name, "fmu", f"{name}.fmu") for name in ("model", "block")}
    outputs = {name: f"model.{name}" for name in model.signals}
    return System(f"{model.name} and its block", components, tuple(connections), inputs, outputs)


def _along(system: System, trial: BoundTrial, stem: str, driven: Sequence[str], start: Mapping[str, float]) -> System:
    """The system driven by a trial's inputs from its first states on."""
    held = [name for name in driven if name in trial.held]
    players = {"trial": ComponentSpec("trial", "player", f"{stem}.csv")}
    if held:
        players["held"] = ComponentSpec(
            "held", "player", f"{stem}.csv", options={"columns": held, "interpolation": "hold"}
        )
    played = [
        Connection(f"{'held' if name in held else 'trial'}.{name}", target)
        for name in driven
        for target in system.inputs[name]
    ]
    step = float(np.median(np.diff(trial.time))) / STEPS
    settings = RunSettings(float(trial.time[0]), float(trial.time[-1]), step, options={"extrapolation": 1})
    left = {name: targets for name, targets in system.inputs.items() if name not in driven}
    model = replace(system.components["model"], values={name: Value(value) for name, value in start.items()})
    components = {**system.components, "model": model, **players}
    name = f"{system.name} along {stem}"
    return replace(
        system, name=name, components=components, connections=(*system.connections, *played), inputs=left, run=settings
    )


def _samples(model: SymbolicModel, trial: BoundTrial, driven: Sequence[str]) -> str:
    """A trial as a table: time, inputs that move, and what was measured."""
    places = places_of(model, driven)
    columns = [trial.time, *(trial.inputs[:, place.index] for place in places.values()), *trial.outputs.T]
    lines = [",".join(("time", *driven, *model.signals))]
    lines += [",".join(f"{value:.12g}" for value in row) for row in np.column_stack(columns)]
    return "\n".join(lines) + "\n"


def _name(model: SymbolicModel, place: Place) -> str:
    return (model.system.states if place.of == "state" else model.system.inputs)[place.index].name


def _write(path: Path, text: str) -> None:
    write_atomically(path, text.encode())
