"""Open a Gaussian process as a component of a co-simulation: a saved block, one that learns, or one learned from a file."""

from pathlib import Path

from fmus.errors import MisfitError
from orchestrator.cosim.component import Component
from orchestrator.cosim.system import ComponentSpec
from orchestrator.gp.block_component import GpComponent
from orchestrator.gp.learning import LearningGp
from orchestrator.measurements.toml_values import number
from orchestrator.measurements.wording import nearest, shown

_OPTIONS = ("inputs", "outputs", "kernel", "noise", "learn")


def open_gp(spec: ComponentSpec, folder: Path) -> Component:
    """Make a component of a saved block (`.json`), or of one learned from a file of measurements.

    A saved block has all it needs; with `learn = { budget = 200, noise = 0.1 }` it learns during the run, see
    `LearningGp`. Measurements need the options `inputs` and `outputs`, names of columns; `kernel` is
    squared_exponential, matern32 or matern52 (the default), `noise` the standard deviation of the outputs if known.
    Each output `tau` comes with `tau_sd`, how well it is known.

    Raises:
        MisfitError: if the file or an option is not what is expected.
    """
    for key in spec.options:
        if key not in _OPTIONS:
            raise MisfitError(f"unknown key {shown(key)}; {nearest(key, _OPTIONS)}")
    path = folder / spec.source
    if path.suffix == ".json":
        if others := [key for key in spec.options if key != "learn"]:
            raise MisfitError(f"{spec.source} is a saved block, which takes no {', '.join(others)}; leave it out")
        from orchestrator.gp.saved import read_block

        block = read_block(path)
        if "learn" not in spec.options:
            return GpComponent(block)
        return LearningGp(block, spec.options["learn"])
    if "learn" in spec.options:
        raise MisfitError(f"learn goes with a saved block (.json), {spec.source} is none; save a block of it first")
    from orchestrator.gp.learned import learn

    noise = spec.options.get("noise")
    if noise is not None and ((noise := number(noise)) is None or noise <= 0.0):
        raise MisfitError(f"noise = {shown(spec.options['noise'])}; expected a standard deviation above 0")
    kernel = spec.options.get("kernel", "matern52")
    return GpComponent(learn(path, _names(spec, "inputs"), _names(spec, "outputs"), str(kernel), noise))


def _names(spec: ComponentSpec, key: str) -> list[str]:
    given = spec.options.get(key)
    if not isinstance(given, list) or not given or not all(isinstance(name, str) for name in given):
        raise MisfitError(f'{key} = {shown(given)}; expected columns of {spec.source}, such as ["w1"]')
    return given
