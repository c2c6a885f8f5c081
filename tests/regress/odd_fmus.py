"""FMUs that are wrong in ways that only a second look shows, made from tests/cosim/fmus/faulty.c by a change of its text."""

import hashlib
import subprocess
import sys
from pathlib import Path

import fmpy

sys.path.insert(0, str(Path(__file__).parents[1] / "cosim"))

from faulty import BINARY, FAULTS, description, faulty_fmu, write_fmu  # noqa: E402

from fmus.files import cache_folder  # noqa: E402
from fmus.runtime.compiler import find_compiler  # noqa: E402

SOURCE = Path(__file__).parents[1] / "cosim/fmus/faulty.c"
_STEP = "c->y += h * c->u;"
_STATES = "fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) { return fmi2Error; }"
_SET = "fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) { return fmi2Error; }"
_FREE = "fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { return fmi2Error; }"
_INCLUDE = "#include <math.h>"
_SAVES = {
    _STATES: "fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) { if (!*s) *s = malloc(sizeof(double)); "
    "*(double *)*s = ((Instance *)c)->y; return fmi2OK; }",
    _SET: "fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) { ((Instance *)c)->y = *(double *)s; return fmi2OK; }",
    _FREE: "fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { free(*s); *s = 0; return fmi2OK; }",
}
# What is changed in the source, and in the description.
ODD: dict[str, tuple[dict[str, str], dict[str, str]]] = {
    # The clock's nanoseconds leak into the result.
    "random": (
        {
            _INCLUDE: "#define _POSIX_C_SOURCE 199309L\n#include <time.h>\n#include <math.h>",
            _STEP: "struct timespec now; clock_gettime(CLOCK_MONOTONIC, &now); "
            "c->y += h * c->u * (1.0 + (t > 0.5 - 1e-9 ? 1e-6 * (now.tv_nsec % 1009) : 0.0));",
        },
        {},
    ),
    # A variable of the library, not of the instance, counts the steps of all runs of a process.
    "static": ({_STEP: "static int steps; steps++; c->y += h * c->u * (1.0 + 1e-6 * steps);"}, {}),
    # The time that a lag has been on is no part of the saved state.
    "forgetful": (
        {
            **_SAVES,
            "double u, y, t, stop;": "double u, y, t, stop, hidden;",
            _STEP: "c->hidden += h; c->y += h * c->hidden;",
        },
        {"<CoSimulation ": '<CoSimulation canGetAndSetFMUstate="true" '},
    ),
    # Crashes in the first run only: a file remembers.
    "once": (
        {
            _STEP: 'const char *mark = getenv("ODD_MARK"); FILE *seen = fopen(mark, "r"); '
            'if (!seen) { seen = fopen(mark, "w"); fclose(seen); abort(); } fclose(seen); c->y += h * c->u;'
        },
        {},
    ),
    # Starts a process of its own and forgets it.
    "forks": ({_STEP: "if (fabs(t - 0.5) < 1e-9 && !fork()) for (;;) pause(); c->y = t + h;"}, {}),
    # Half a percent too much.
    "biased": ({_STEP: "c->y += 1.005 * h * c->u;"}, {}),
    # Never silent, never done: every step takes a while.
    "slow": ({_STEP: "usleep(20000); c->y += h * c->u;"}, {}),
    # A value that is no number, for one step only.
    "blink": ({_STEP: "c->y = fabs(t - 0.5) < 1e-9 ? NAN : t + h;"}, {}),
}


def odd_fmu(folder: Path, name: str) -> Path:
    """The FMU of `ODD` in a folder, as NAME.fmu; compiled once."""
    code, told = ODD[name]
    source, text = SOURCE.read_text(), description("none")
    for old, new in code.items():
        assert old in source, old
        source = source.replace(old, new)
    for old, new in told.items():
        assert old in text, old
        text = text.replace(old, new)
    return write_fmu(folder / f"{name}.fmu", {"modelDescription.xml": text, BINARY: _compiled(source)})


def plain_fmu(folder: Path) -> Path:
    """The same FMU without anything odd, as none.fmu."""
    return faulty_fmu(folder, "none")


def _compiled(source: str) -> bytes:
    folder = cache_folder("test-fmus") / f"odd-{hashlib.sha256(source.encode()).hexdigest()[:16]}"
    library = folder / "odd.so"
    if not library.is_file():
        folder.mkdir(exist_ok=True)
        (folder / "odd.c").write_text(source)
        include = Path(fmpy.__file__).parent / "c-code"
        flags = ["-O1", "-w", "-fPIC", "-shared", f"-I{include}", f"-DFAULT={FAULTS.index('none')}"]
        subprocess.run([*find_compiler(), *flags, "-o", folder / "new.so", folder / "odd.c", "-lm"], check=True)
        (folder / "new.so").replace(library)
    return library.read_bytes()
