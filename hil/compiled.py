"""The decision as machine code, made from the very modules that decide without it: `misfit hil compile`.

mypyc translates the modules below to C and compiles them. There is one source: the same files run as Python where nobody has compiled
them, where they have changed since, or with MISFIT_PURE=1, and are what the machine code is compared with
(`python -m tests.benchmarks.hil.compiled`).
"""

import hashlib
import importlib.machinery
import importlib.util
import os
import shutil
import sys
import sysconfig
import tempfile
from collections.abc import Sequence
from functools import cache
from importlib.abc import MetaPathFinder
from pathlib import Path
from types import ModuleType

from fmus.errors import MisfitError
from fmus.files import cache_folder, cache_path

MODULES = (
    *(f"hil.safety.{name}" for name in ("cycle", "limits", "motion", "rules", "limiters", "core")),
    *(f"hil.robots.{name}" for name in ("base", "answers", "proficio")),
    *(f"hil.codecs.barrett.{name}" for name in ("torques", "positions", "force_torque", "properties", "safety_module")),
    "hil.record",
    "hil.codecs.frame",
    "hil.bus.gate",
    "hil.barrett.link",
    "hil.barrett.start_up",
    "hil.control.controllers",
    "hil.control.pilot",
    "hil.recording.records",
    "hil.recording.replay",
)
# Packages whose source mypyc looks at.
_PACKAGES = ("hil", "fmus")
_HERE = Path(__file__).parents[1]
_SUFFIX = sysconfig.get_config_var("EXT_SUFFIX") or ".so"
PURE = "MISFIT_PURE"
# Products and sums are rounded each, as in Python: some processors could do both in one step, with another last bit.
EXACT = "-ffp-contract=off"


def source_of(module: str) -> Path:
    """The file of one of the modules."""
    return _HERE.joinpath(*module.split(".")).with_suffix(".py")


@cache
def folder() -> Path:
    """Where the machine code of these very sources belongs, for this Python on this machine."""
    key = hashlib.sha256(sys.version.encode() + _SUFFIX.encode())
    for module in MODULES:
        key.update(source_of(module).read_bytes())
    return cache_path("decisions") / key.hexdigest()[:24]


def is_built() -> bool:
    """Whether these very sources have been compiled."""
    return folder().is_dir()


def is_used() -> bool:
    """Whether decisions are those of the machine code here."""
    module = sys.modules.get("hil.safety.core")
    return module is not None and str(getattr(module, "__file__", "")).endswith(_SUFFIX)


def build() -> Path:
    """Compile; what is there already stays.

    Raises:
        MisfitError: without mypyc or a C compiler, or if they fail.
    """
    from fmus.children import child_environment, python_command, run_tool  # not needed to find what is compiled

    target = folder()
    if target.is_dir():
        return target
    if importlib.util.find_spec("mypyc") is None or importlib.util.find_spec("setuptools") is None:
        raise MisfitError(
            "mypyc is not installed; install it: pip install mypy setuptools. Sessions run without it, too"
        )
    with tempfile.TemporaryDirectory(dir=cache_folder(target.parent.name)) as place:
        tree = Path(place)
        for package in _PACKAGES:
            shutil.copytree(
                _HERE / package, tree / package, ignore=shutil.ignore_patterns("__pycache__", "*.so", "build")
            )
        files = [str(source_of(module).relative_to(_HERE)) for module in MODULES]
        command = python_command("mypyc", "--ignore-missing-imports", "--follow-imports=silent", *files)
        done = run_tool(command, folder=tree, environment=child_environment(**{PURE: "1", "CFLAGS": EXACT}))
        if done.returncode != 0:
            said = (done.stderr or done.stdout).strip().splitlines()
            raise MisfitError(f"the decision could not be compiled: {said[-1] if said else 'mypyc failed'}")
        built = tree / "built"
        for file in [*tree.glob(f"*{_SUFFIX}"), *(tree / "hil").rglob(f"*{_SUFFIX}")]:
            (built / file.relative_to(tree)).parent.mkdir(parents=True, exist_ok=True)
            shutil.move(file, built / file.relative_to(tree))
        if not target.is_dir():  # somebody else may have been faster
            os.replace(built, target)
    return target


class _Finder(MetaPathFinder):
    """Finds the compiled modules, and the library that they share."""

    def __init__(self, place: Path) -> None:
        self.place = place

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """The machine code of a module, if it is one of these."""
        if os.environ.get(PURE):  # said after this package was imported
            return None
        if name not in MODULES and not name.endswith("__mypyc"):
            return None
        file = self.place.joinpath(*name.split(".")[:-1], name.rpartition(".")[2] + _SUFFIX)
        if not file.exists():
            return None
        loader = importlib.machinery.ExtensionFileLoader(name, str(file))
        return importlib.util.spec_from_file_location(name, file, loader=loader)


def use() -> None:
    """Take the machine code for these modules where it is there; for the package's own start, before any of them is imported."""
    if os.environ.get(PURE) or not is_built() or any(isinstance(finder, _Finder) for finder in sys.meta_path):
        return
    sys.meta_path.insert(0, _Finder(folder()))
