"""Find the model that a MODEL argument names."""

from pathlib import Path
from typing import TYPE_CHECKING

from fmus.catalogue import ModelicaModel, find_modelica_model
from fmus.errors import MisfitError
from fmus.files import cache_folder
from orchestrator.measurements import MeasurementSet
from orchestrator.models.contract import Model

if TYPE_CHECKING:
    from orchestrator.blackbox.source import Source

SYSTEM_ENDINGS = (".toml", ".ssd", ".ssp")


def is_closed(text: str) -> bool:
    """Whether a MODEL argument names something whose equations are closed: an FMU, or a coupled system."""
    return text.lower().endswith((".fmu", *SYSTEM_ENDINGS))


def load_model(text: str) -> Model:
    """Return the model for an FMU or system file, `FILE.mo:Class` or the name of a built-in.

    Raises:
        MisfitError: if there is no such model or it cannot be read.
    """
    if is_closed(text):
        from orchestrator.blackbox.source import fmu_model

        return fmu_model(Path(text))
    from orchestrator.models.symbolic import SymbolicModel

    source = load_modelica(text)
    system = source.compile()
    if system.remembers:
        # What is kept from event to event runs in an FMU only.
        from fmus.package import build_fmu
        from orchestrator.blackbox.source import fmu_model

        return fmu_model(build_fmu(system, cache_folder("remembering") / source.fingerprint / f"{source.name}.fmu"))
    return SymbolicModel(text, system)


def load_source(text: str, measurements: MeasurementSet) -> "Source":
    """Return what can be diagnosed and extended: a Modelica class, or an FMU or system with the sites it offers for the data.

    Raises:
        MisfitError: if there is no such model, it cannot be read, or the data do not fit it.
        ComponentError: if an FMU fails while it is looked at.
    """
    if is_closed(text):
        from orchestrator.blackbox.source import FmuSource

        return FmuSource.prepare(Path(text), measurements)
    return load_modelica(text)


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
