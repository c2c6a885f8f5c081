"""Plants from milli to kilo scale: exact similarity images of simulated ones, with models that are scaled alike.

Lengths grow by L, masses by M, times by sqrt(L), so that gravity stays what it is; equations of motion and Torricelli's law hold
in the image, and so does every effect, with other parameters.
"""

import re
from collections.abc import Mapping
from pathlib import Path

from tests.benchmarks.diagnosis.truth.machines import Machine
from tests.benchmarks.diagnosis.world.files import Columns, edit_toml, rewrite

# Lengths and masses of an image: a watch, a crane.
SCALES = {"milli": (0.1, 1e-3), "kilo": (10.0, 1e3)}
# Powers of length, mass and time by unit of a column, and by kind of a model's parameter.
_UNITS = {"rad": (0, 0, 0), "m": (1, 0, 0), "N": (1, 1, -2), "N.m": (2, 1, -2), "m3/s": (3, 0, -1), "1": (0, 0, 0)}
_VALUES: Mapping[str, Mapping[str, tuple[int, int, int]]] = {
    "pendulum": {"m": (0, 1, 0), "a": (1, 0, 0), "I": (2, 1, 0)},
    "drive": {"J": (2, 1, 0)},
    "two-mass": {"JMotor": (2, 1, 0), "JLoad": (2, 1, 0), "k": (2, 1, -2), "d": (2, 1, -1)},
    "cart": {"M": (0, 1, 0), "m": (0, 1, 0), "a": (1, 0, 0), "I": (2, 1, 0)},
    "tanks": {"A1": (2, 0, 0), "A2": (2, 0, 0), "a1": (2, 0, 0), "a2": (2, 0, 0)},
}
MACHINES_WITH_IMAGES = tuple(_VALUES)
_CLASSES = {"pendulum": "Pendulum", "drive": "Drive", "two-mass": "TwoMassDrive", "cart": "Cart", "tanks": "TwoTanks"}


def factor(powers: tuple[int, int, int], scale: str) -> float:
    """Factor of a quantity in an image.

    >>> round(factor(_UNITS["N"], "kilo"))
    1000
    """
    length, mass = SCALES[scale]
    return float(length ** powers[0] * mass ** powers[1] * length ** (0.5 * powers[2]))


def scale_case(folder: Path, machine: Machine, scale: str) -> str:
    """Turn a written case into its image, with a model file beside the trials; returns the MODEL argument."""
    units = {**machine.inputs, **machine.outputs, "time": "time"}
    factors = {name: factor(_UNITS.get(unit, (0, 0, 1)), scale) for name, unit in units.items()}

    def image(columns: Columns, number: int) -> Columns:
        return {name: values * factors[name] for name, values in columns.items()}

    rewrite(folder, image)
    edit_toml(folder, lambda text: _scaled_toml(text, factors))
    return _model(folder, machine, scale)


def _scaled_toml(text: str, factors: Mapping[str, float]) -> str:
    def number(found: re.Match[str]) -> str:
        name = next(n for n in sorted(factors, key=len, reverse=True) if found[1].lstrip('"').startswith(f"{n}_"))
        return f"{found[1]} = {float(found[2]) * factors[name]:.6e}"

    text = re.sub(r"^(\"?\w+_(?:noise_std|resolution)_[^=]*?) = (\S+)$", number, text, flags=re.MULTILINE)
    return re.sub(r"rate_hz = (\S+)", lambda found: f"rate_hz = {float(found[1]) / factors['time']:.9g}", text)


def _model(folder: Path, machine: Machine, scale: str) -> str:
    changed = [
        f"{machine.tolerances[name]}={machine.values[name] * factor(powers, scale):.12g}"
        for name, powers in _VALUES[machine.name].items()
    ]
    text = (
        f'model Image "The {machine.name} at {scale} scale"\n'
        f"  extends FESArm.Plants.{_CLASSES[machine.name]}({', '.join(changed)});\nend Image;\n"
    )
    (folder / "Image.mo").write_text(text)
    return f"{folder / 'Image.mo'}:Image"
