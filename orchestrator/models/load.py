"""Find the model that a MODEL argument names."""

from pathlib import Path

from fmus.catalogue import ModelicaModel, find_modelica_model
from fmus.errors import MisfitError
from orchestrator.models.contract import Model

SYSTEM_ENDINGS = (".toml", ".ssd", ".ssp")


def load_model(text: str) -> Model:
    """Return the model for an FMU path, `FILE.mo:Class` or the name of a built-in.

    Raises:
        MisfitError: if there is no such model or it cannot be read.
    """
    if text.endswith(".fmu"):
        from orchestrator.models.fmu import FmuModel

        return FmuModel(Path(text))
    from orchestrator.models.symbolic import SymbolicModel

    source = load_modelica(text)
    return SymbolicModel(text, source.compile())


def load_modelica(text: str) -> ModelicaModel:
    """Return the Modelica source of a model, for commands that need its equations.

    Raises:
        MisfitError: if the argument names something else.
    """
    if text.endswith(SYSTEM_ENDINGS):
        raise MisfitError(f"{text}: system files are not supported yet; name an FMU, FILE.mo:Class or a built-in model")
    if text.endswith(".fmu"):
        raise MisfitError(f"{text} is an FMU, whose equations are closed; name its Modelica class (FILE.mo:Class)")
    return find_modelica_model(text)
