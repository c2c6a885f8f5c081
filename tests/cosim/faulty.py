"""FMUs that do something wrong, built from `fmus/faulty.c`: one for each fault; and what a process holds."""

import gc
import os
import subprocess
import time
import zipfile
from contextlib import suppress
from functools import cache
from pathlib import Path

import fmpy

from fmus.runtime.compiler import find_compiler
from orchestrator.cosim.isolate.process import end_waiting

# The order of the enumeration in faulty.c.
FAULTS = [
    "none",
    "segfault",
    "abort",
    "hang",
    "exit",
    "stack",
    "memory",
    "nan",
    "discard",
    "initialise",
    "open_file",
    "error",
    "fatal",
    "big",
    "initialise_segfault",
    "null",
    "divide",
    "chatter",
    "close_all",
    "past_stop",
    "fork",
    "apart",
]
HERE = Path(__file__).parent
BINARY = "binaries/linux64/faulty.so"

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
{doctype}<fmiModelDescription fmiVersion="2.0" modelName="faulty" guid="{{{fault}}}">
  <CoSimulation modelIdentifier="faulty" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit><Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit></UnitDefinitions>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.01"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input" variability="continuous"><Real unit="m/s" start="1"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output" variability="continuous" initial="exact"><Real unit="m" start="0" max="1000"/></ScalarVariable>
{more}  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies=""/></Outputs></ModelStructure>
</fmiModelDescription>
"""


def description(fault: str, doctype: str = "", more: str = "") -> str:
    """Text of modelDescription.xml."""
    return DESCRIPTION.format(fault=fault, doctype=doctype, more=more)


@cache
def binary(fault: str, *flags: str) -> bytes:
    """Shared library that does one thing wrong."""
    folder = Path(subprocess.run(["mktemp", "-d"], capture_output=True, text=True, check=True).stdout.strip())
    include = Path(fmpy.__file__).parent / "c-code"
    command = [*find_compiler(), "-O1", "-w", "-fPIC", "-shared", f"-I{include}", f"-DFAULT={FAULTS.index(fault)}"]
    subprocess.run([*command, "-o", folder / "faulty.so", HERE / "fmus/faulty.c", *flags], check=True)
    return (folder / "faulty.so").read_bytes()


def write_fmu(path: Path, files: dict[str, str | bytes]) -> Path:
    """Write an archive."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def faulty_fmu(folder: Path, fault: str) -> Path:
    """The FMU with a fault, as `FAULT.fmu` in a folder."""
    return write_fmu(folder / f"{fault}.fmu", {"modelDescription.xml": description(fault), BINARY: binary(fault)})


def children() -> set[str]:
    """Numbers of the child processes of this process."""
    return {pid for task in Path("/proc/self/task").iterdir() for pid in (task / "children").read_text().split()}


def held() -> set[str]:
    """Open files and child processes of this process, without what waits to be collected or used.

    A studio of another test in this process may look at sessions of further ones, through their files of shared memory.
    """
    end_waiting()
    gc.collect()
    files = set()
    for number in os.listdir("/proc/self/fd"):
        with suppress(OSError):  # closed since it was listed, as the list itself is
            files.add(f"{number} {os.readlink(f'/proc/self/fd/{number}')}")
    return {each for each in files if "/dev/shm/misfit-" not in each} | children()


def left_behind(before: set[str], patience: float = 5.0) -> set[str]:
    """What is held beyond what was held `before`, once that is nothing or after `patience` seconds.

    Other threads of a test process, of a server or a cluster, may open files of their own for a moment.
    """
    until = time.monotonic() + patience
    while (more := held() - before) and time.monotonic() < until:
        time.sleep(0.05)
    return more
