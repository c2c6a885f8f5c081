"""Every fault of an FMU that misfit has to survive, and what the user reads; `python tests/cosim/fault_table.py` writes the table.

Each is run as `misfit run` runs foreign FMUs: in a process of its own, recorded to a file.
"""

import re
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from faulty import BINARY, binary, description, write_fmu

from fmus.errors import MisfitError
from fmus.runtime.compiler import find_compiler
from orchestrator.cosim.isolate.process import ChildLimits
from orchestrator.cosim.load import load_system
from orchestrator.cosim.run import RunOptions, run_system
from orchestrator.results import read_result, recorder_for

DOCUMENT = Path(__file__).parents[2] / "docs/faults.md"
HEAD = """# What broken FMUs do to misfit

Written by `python tests/cosim/fault_table.py`, checked by `tests/cosim/test_fault_table.py`. Each FMU (`tests/cosim/fmus/faulty.c`)
is run in steps of 0.01 s and misbehaves at 0.5 s, in a process of its own as `misfit run` does it for FMUs that it
does not trust; here with 1 s of patience (60 s by default) and 0.5 GiB of memory (4 GiB). In no case
does the host end, leave a process or a file open, or print a traceback; rows until the fault are in the results.

| fault | exit code | rows kept | what the user reads |
|---|---|---|---|
"""


@dataclass(frozen=True)
class Outcome:
    """Exit code, number of rows in the result file, and the message."""

    code: int
    rows: int
    words: str


def _code(fault: str, *flags: str) -> Callable[[], dict[str, str | bytes]]:
    return lambda: {"modelDescription.xml": description(fault), BINARY: binary(fault, *flags)}


def _text(doctype: str) -> Callable[[], dict[str, str | bytes]]:
    return lambda: {"modelDescription.xml": description("none", doctype), BINARY: binary("none")}


def _climbing() -> dict[str, str | bytes]:
    return {**_code("none")(), "../../outside.txt": "escaped"}


def _many() -> dict[str, str | bytes]:
    one = '<ScalarVariable name="p{0}" valueReference="{0}" causality="local" variability="continuous"><Real/></ScalarVariable>\n'
    more = "".join(one.format(k) for k in range(2, 100_000))
    return {"modelDescription.xml": description("none", more=more), BINARY: binary("none")}


def _gone() -> dict[str, str | bytes]:
    """Linked against a library that nobody ships."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "gone.c").write_text("int gone(void) { return 0; }")
        command = [*find_compiler(), "-fPIC", "-shared", "-o", f"{folder}/libgone.so", f"{folder}/gone.c"]
        subprocess.run(command, check=True)
        return {
            "modelDescription.xml": description("none"),
            BINARY: binary("none", "-Wl,--no-as-needed", f"-L{folder}", "-lgone"),
        }


def _foreign() -> dict[str, str | bytes]:
    """For another processor: the machine's number in the ELF header is changed to that of 64-bit ARM."""
    content = bytearray(binary("none"))
    struct.pack_into("<H", content, 18, 183)
    return {"modelDescription.xml": description("none"), BINARY: bytes(content)}


_LAUGHS = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
FAULTS: dict[str, Callable[[], dict[str, str | bytes]]] = {
    "none": _code("none"),
    "segmentation fault": _code("segfault"),
    "`abort()`": _code("abort"),
    "endless loop": _code("hang"),
    "`exit(0)`": _code("exit"),
    "stack overflow": _code("stack"),
    "allocates and fills 10 GB": _code("memory"),
    "division by zero of integers": _code("divide"),
    "NaN output": _code("nan"),
    "output beyond its `max`": _code("big"),
    "status Discard": _code("discard"),
    "status Error, with a message": _code("error"),
    "status Fatal": _code("fatal"),
    "error at initialise": _code("initialise"),
    "segmentation fault at initialise": _code("initialise_segfault"),
    "instantiate returns NULL": _code("null"),
    "leaves a file open in every step": _code("open_file"),
    "prints 700 kB in every step": _code("chatter"),
    "zip with `../` paths": _climbing,
    "XML with an external entity": _text('<!DOCTYPE f [<!ENTITY e SYSTEM "file:///etc/passwd">]>'),
    "XML with a billion laughs": _text(f'<!DOCTYPE f [<!ENTITY l0 "ha">{_LAUGHS}]>'),
    "100,000 variables": _many,
    "missing dependency library": _gone,
    "binary for another architecture": _foreign,
}


def observe(fault: str, folder: Path) -> Outcome:
    """Run the FMU with a fault, recorded to a file of the folder."""
    path = write_fmu(folder / "tank.fmu", FAULTS[fault]())
    limits = ChildLimits(1.0 if fault == "endless loop" else 60.0, 0.5)
    target = folder / "run.parquet"
    code, words = 0, "(runs to its end)"
    try:
        run_system(load_system(path), recorder_for(target), RunOptions(isolate=True, limits=limits, step=0.01))
    except MisfitError as error:
        code, words = error.exit_code, str(error)
    rows = len(read_result(target).time) if target.exists() else 0
    words = re.sub(r"took 0\.\d GiB", "took 0.5 GiB", words.replace(f"{folder}/", ""))
    return Outcome(code, rows, re.sub(r"/\S*/unpacked/\w+/", "", words))


def table(outcomes: dict[str, Outcome]) -> str:
    """The document."""
    lines = [
        f"| {fault} | {o.code} | {o.rows or '-'} | {o.words.replace('|', chr(92) + '|')} |"
        for fault, o in outcomes.items()
    ]
    return HEAD + "\n".join(lines) + "\n"


def main() -> None:
    """Write the document."""
    outcomes = {}
    for fault in FAULTS:
        with tempfile.TemporaryDirectory() as folder:
            outcomes[fault] = observe(fault, Path(folder))
    DOCUMENT.write_text(table(outcomes))


if __name__ == "__main__":
    sys.exit(main())
