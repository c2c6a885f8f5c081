"""Find the model that a MODEL argument names."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fmus.catalogue import ModelicaModel, find_modelica_model
from fmus.errors import MisfitError, ModelicaError
from orchestrator.greybox.kept import MOST_ROWS
from orchestrator.measurements import MeasurementSet
from orchestrator.models.contract import Model

if TYPE_CHECKING:
    from orchestrator.blackbox.source import Source
    from orchestrator.models.symbolic import SymbolicModel

SYSTEM_ENDINGS = (".toml", ".ssd", ".ssp")


def is_closed(text: str) -> bool:
    """Whether a MODEL argument names something whose equations are closed: an FMU, or a coupled system."""
    return text.lower().endswith((".fmu", *SYSTEM_ENDINGS))


def runs_as_fmu(text: str) -> bool:
    """Whether a MODEL is an FMU or a system, or a class that keeps values from event to event, which may be diagnosed as one."""
    return is_closed(text) or load_modelica(text).compile().remembers


def is_open(text: str) -> bool:
    """Whether effects can act in the equations of a MODEL, whatever the data: a class whose states do not jump at events."""
    return not is_closed(text) and not _is_closed_class(load_modelica(text))


def load_model(text: str) -> Model:
    """Return the model for an FMU or system file, `FILE.mo:Class` or the name of a built-in.

    Raises:
        MisfitError: if there is no such model or it cannot be read.
    """
    if is_closed(text):
        from orchestrator.blackbox.source import fmu_model

        return fmu_model(Path(text))
    from orchestrator.blackbox.of_class import class_model

    return class_model(load_modelica(text), text)


def _is_closed_class(source: ModelicaModel) -> bool:
    """Whether a class is diagnosed as an FMU: its states jump at events, or it keeps values from event to event beside slots."""
    from orchestrator.models.patch import free_slots

    system = source.compile()
    return system.jumps or (system.remembers and bool(free_slots(system)))


def _ticks_too_fast(source: ModelicaModel, measurements: MeasurementSet) -> bool:
    """Whether clocks of a class tick so often between samples that a record says nothing of single ticks."""
    system = source.compile()
    relations = system.relations
    if relations is None or relations.memory is None:
        return False
    memory, p = relations.memory, [v.start or 0.0 for v in system.parameters]
    kept = np.array(memory.start(0.0, p)).ravel()
    period = np.array(memory.due(kept + 1.0)) - np.array(memory.due(kept))
    step = max(float(np.median(np.diff(trial.time))) for trial in measurements.trials)
    return bool(np.any(period * MOST_ROWS < step))


def load_source(text: str, measurements: MeasurementSet) -> "Source":
    """Return what can be diagnosed and extended: a Modelica class, or an FMU or system with the sites it offers for the data.

    Raises:
        MisfitError: if there is no such model, it cannot be read, or the data do not fit it.
        ComponentError: if an FMU fails while it is looked at.
    """
    source = None if is_closed(text) else load_modelica(text)
    if source is not None and not _is_closed_class(source) and not _ticks_too_fast(source, measurements):
        return source
    from orchestrator.blackbox.of_class import class_fmu
    from orchestrator.blackbox.source import FmuSource

    prepared = FmuSource.prepare(Path(text) if source is None else class_fmu(source), measurements)
    # A class that runs as an FMU keeps its name; where its FMU lies is nobody's business.
    return prepared if source is None else replace(prepared, name=source.name)


def load_modelica(text: str) -> ModelicaModel:
    """Return the Modelica source of a model, for commands that need its equations.

    Raises:
        MisfitError: if the argument names something else.
    """
    if text.endswith(SYSTEM_ENDINGS):
        raise MisfitError(
            f"{text} is a coupled system, whose equations are closed; name a Modelica class (FILE.mo:Class)"
        )
    if text.endswith(".fmu"):
        raise MisfitError(f"{text} is an FMU, whose equations are closed; name its Modelica class (FILE.mo:Class)")
    return find_modelica_model(text)


def with_forces(source: ModelicaModel, name: str) -> "SymbolicModel":
    """The model of a class with an input for the force that it may lack on each of its signals: its own, or those at its balances.

    Its signals are the outputs of which such an input is told, all outputs if there is none.

    Raises:
        MisfitError: if the class cannot be compiled, or keeps values from event to event.
    """
    from orchestrator.models.correction import PREFIX, with_corrections
    from orchestrator.models.symbolic import SymbolicModel

    system = source.compile()
    if not any(v.name.startswith(PREFIX) for v in system.inputs):
        balanced, balances = source.balanced()
        if balanced.kept is not None:
            raise ModelicaError(
                f"{name} keeps values from event to event ({', '.join(balanced.kept.names[:3])}), which fits cannot follow"
            )
        system = with_corrections(balanced, balances)
    forces = {v.name.removeprefix(PREFIX) for v in system.inputs if v.name.startswith(PREFIX)}
    shown = [output for output in system.outputs if output in forces]
    return SymbolicModel(name, system, shown or None)
