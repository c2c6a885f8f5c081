"""Where the Modelica library is: beside the package in a checkout, inside it in an installed wheel."""

from pathlib import Path


def library_root() -> Path:
    """Return the folder that contains `FESArm/package.mo`."""
    package = Path(__file__).resolve().parent
    installed = package / "modelica"
    return installed if installed.is_dir() else package.parent / "modelica"
