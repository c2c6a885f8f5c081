"""The compiled truth simulator: built once from `native/` with the system's C compiler, with MuJoCo where installed."""

import ctypes
import hashlib
import importlib.util
import os
import shutil
import subprocess
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

SOURCES = Path(__file__).parent / "native"
BUILD = Path(__file__).parents[4] / "build" / "truth"
KINDS = ("arm", "double-pendulum", "pendulum", "cart", "drive", "two-mass")
DOFS = {"pendulum": 1, "drive": 1}
STEP = 1e-3


class TruthError(Exception):
    """The truth simulator cannot be built, or a motion left all bounds."""


def has_mujoco() -> bool:
    """Tell whether MuJoCo is installed (`pip install misfit-fmu[bench]`)."""
    return importlib.util.find_spec("mujoco") is not None


@cache
def library() -> ctypes.CDLL:
    """Build and load the simulator; a build is kept until a source changes."""
    BUILD.mkdir(parents=True, exist_ok=True)
    names = sorted(p.name for p in SOURCES.glob("*.c") if p.name != "mujoco_linkage.c" or has_mujoco())
    content = b"".join((SOURCES / name).read_bytes() for name in [*names, "truth.h"])
    flags = _mujoco_flags() if has_mujoco() else ["-DNO_MUJOCO"]
    target = BUILD / f"truth_{hashlib.sha256(content + repr(flags).encode()).hexdigest()[:16]}.so"
    if not target.exists():
        partial = target.with_suffix(f".{os.getpid()}")
        compiler = os.environ.get("CC") or shutil.which("cc") or "gcc"
        command = [compiler, "-O2", "-std=c11", "-Wall", "-Wextra", "-shared", "-fPIC", "-o", str(partial)]
        done = subprocess.run(
            [*command, *(str(SOURCES / name) for name in names), *flags, "-lm"], capture_output=True, text=True
        )
        if done.returncode:
            raise TruthError(f"the truth simulator does not compile: {done.stderr.strip()}")
        partial.replace(target)
    return ctypes.CDLL(str(target))


def _mujoco_flags() -> list[str]:
    spec = importlib.util.find_spec("mujoco")
    assert spec is not None and spec.origin is not None
    home = Path(spec.origin).parent
    shared = next(home.glob("libmujoco.so*"))
    return [f"-I{home / 'include'}", str(shared), f"-Wl,-rpath,{home}"]


@cache
def value_names() -> tuple[str, ...]:
    """Names of all numbers that describe a machine or an effect; they are explained in `native/truth.h`."""
    lib = library()
    lib.value_name.restype = ctypes.c_char_p
    return tuple(lib.value_name(i).decode() for i in range(lib.n_values()))


def packed(values: Mapping[str, float]) -> np.ndarray:
    """Values by name as the simulator takes them."""
    names = value_names()
    array = np.zeros(len(names))
    for name, value in values.items():
        array[names.index(name)] = value
    return array


def simulate(
    kind: str,
    values: Mapping[str, float],
    inputs: np.ndarray,
    q0: np.ndarray,
    v0: np.ndarray,
    *,
    start: float = 0.0,
    step: float = STEP,
    mujoco: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and speeds (steps + 1, dofs) at every step, from `q0`, `v0` (dofs,) and inputs (steps + 1, width).

    `start` is the time of the first sample in s; inputs are straight between their samples.

    Raises:
        TruthError: if the motion leaves all bounds.
    """
    dofs = DOFS.get(kind, 2)
    u = np.ascontiguousarray(inputs, dtype=float)
    out = np.empty((len(u), 2 * dofs))
    q, v = np.array(q0, dtype=float), np.array(v0, dtype=float)
    failed = library().simulate(
        KINDS.index(kind),
        int(mujoco and has_mujoco()),
        _pointer(packed(values)),
        ctypes.c_double(start),
        ctypes.c_double(step),
        len(u) - 1,
        u.shape[1],
        _pointer(u),
        _pointer(q),
        _pointer(v),
        _pointer(out),
    )
    if failed:
        raise TruthError(f"{kind}: the motion left all bounds at t = {start + failed * step:.3f} s")
    return out[:, :dofs], out[:, dofs:]


def simulate_tanks(values: Mapping[str, float], inflow: np.ndarray, levels: np.ndarray, *, step: float) -> np.ndarray:
    """Levels of both tanks in m and the outflow in m3/s, (steps + 1, 3), for an inflow (steps + 1,) in m3/s."""
    u, first = np.ascontiguousarray(inflow, dtype=float).ravel(), np.array(levels, dtype=float)
    out = np.empty((len(u), 3))
    library().simulate_tanks(
        _pointer(packed(values)), ctypes.c_double(step), len(u) - 1, _pointer(u), _pointer(first), _pointer(out)
    )
    return out


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    # The caller holds a reference to the array while the C code runs.
    pointer = ctypes.c_void_p(array.ctypes.data)
    pointer.array = array  # type: ignore[attr-defined]
    return pointer
