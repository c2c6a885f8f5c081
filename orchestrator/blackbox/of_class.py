"""The model of a Modelica class: compiled equations, or its FMU where it keeps values from event to event."""

from collections.abc import Sequence
from pathlib import Path

from fmus.catalogue import ModelicaModel
from fmus.files import cache_folder
from fmus.package import build_fmu
from orchestrator.blackbox.source import fmu_model
from orchestrator.models.symbolic import SymbolicModel


def class_model(source: ModelicaModel, name: str = "", signals: Sequence[str] | None = None) -> SymbolicModel:
    """The model of a class, with the inputs held that its source says.

    Args:
        source: the class.
        name: what it is called, by default as its source.
        signals: outputs to compare, all by default.

    Raises:
        MisfitError: if it cannot be compiled.
        ComponentError: if its FMU fails while it is looked at.
    """
    system, name = source.compile(), name or source.name
    if not system.remembers:
        return SymbolicModel(name, system, signals, held=source.held)
    model = fmu_model(class_fmu(source), name=name)
    return model.restricted(model.signals if signals is None else signals).with_held(source.held)


def class_fmu(source: ModelicaModel) -> Path:
    """The FMU of a class in the cache.

    Raises:
        MisfitError: if it cannot be compiled.
    """
    return build_fmu(source.compile(), cache_folder("remembering") / source.fingerprint / f"{source.name}.fmu")
