"""Every command of the command line, with arguments that let it start the child processes that it has."""

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests/cosim"))

from faulty import faulty_fmu  # noqa: E402
from small_fmus import small_fmu  # noqa: E402

MISFIT = Path(sys.executable).with_name("misfit")
CLASS = "model Fall\n  Real x(start=1, fixed=true);\nequation\n  der(x) = -{rate}*x;\nend Fall;\n"
CASE = 'model = "{model}"\nreference = "exact.csv"\n[run]\nstop = 1.0\nstep = 0.5\n'
CHECK = 'files = ["trial.csv"]\nlearning_window_s = [0.0, 0.6]\nheld_out_window_s = [0.6, 1.0]\n[columns]\ntime = "s"\n'
# A job of the studio, which runs in the folder of its project; that gets what the working folder holds.
JOB = """
import shutil, sys, time
from pathlib import Path
from orchestrator.studio import jobs
from orchestrator.studio.workspace import Workspace

project = Workspace(Path("studio")).create("p")
for file in Path().glob("*.py"):
    shutil.copy(file, project.folder)
if "endless" in sys.argv:
    jobs.PROGRAM = (sys.executable, "-c", "import time; time.sleep(600)")
jobs.start(project, "compare")
while jobs.look(project).running:
    time.sleep(0.02)
"""


RUN = "[run]\nstop = 600.0\nstep = 0.02\n"
ROBOT = RUN + '[components.robot]\nkind = "robot"\nvirtual = true\nrate_hz = 50\n'


def arguments_of(command: str, folder: Path, fmu: Path) -> list[str]:
    """The command line of a command, with what it needs written into a folder."""
    ours = str(MISFIT)
    if command == "build":
        for name, rate in (("one", 1), ("two", 2)):
            (folder / f"{name}.mo").write_text(CLASS.format(rate=rate).replace("Fall", name.title()))
        return [ours, "build", "one.mo:One", "two.mo:Two", "--out", "built", "--workers", "2"]
    if command in ("regress cases", "regress bisect", "pytest"):
        shutil.copy(fmu, fmu.with_name("second.fmu"))  # versions, among which `bisect` looks
        (folder / "exact.csv").write_text("time,x\n0,1\n0.5,1\n1,1\n")
        (folder / "fall.regress.toml").write_text(CASE.format(model=fmu))
        bisect = [ours, "regress", "bisect", str(fmu.parent), "fall.regress.toml"]
        cases = [ours, "regress", "fall.regress.toml"]
        return {"pytest": [sys.executable, "-m", "pytest", "."], "regress bisect": bisect}.get(command, cases)
    if command in ("compare", *OTHERS_WITH_MODELS):
        rows = "".join(f"{0.01 * k:.2f},{0.01 * k:.2f},1\n" for k in range(101))
        (folder / "data").mkdir()
        (folder / "data/trial.csv").write_text("time,y,u\n" + rows)
        (folder / "data/case.toml").write_text(CHECK + 'y = "m"\nu = "m/s"\n')
        place = ["--out", "out"] if command == "discover" else []
        return [ours, command, "pendulum" if command == "learn" else str(fmu), "data", *place]
    (folder / "trial.csv").write_text("time,theta\n0,1\n0.5,0.6\n1,0.4\n")
    (folder / "robot.toml").write_text(ROBOT)
    (folder / "system.toml").write_text(RUN + '[components.swing]\nmodelica = "pendulum"\n')
    return {
        "add": [ours, "add", "coulomb_friction", "--to", "pendulum", "--out", "out"],
        "convert": [ours, "convert", "system.toml", "system.ssp"],
        "import": [ours, "import", "trial.csv", "--model", "pendulum", "--yes"],
        "models": [ours, "models"],
        "hil check": [ours, "hil", "check", "--virtual"],
        "hil compile": [ours, "hil", "compile"],
        "hil identify": [ours, "hil", "identify", "robot.toml", "--out", "identified"],
        "hil record": [ours, "hil", "record", "study", "--virtual", "--rate", "50", "--out", "recorded"],
        "hil robot": [ours, "hil", "robot", "--port", "0", "--body", "arm"],
        "hil stimulate": [ours, "hil", "stimulate", "--virtual", "--out", "stimulated"],
        "validate": [ours, "validate", str(fmu)],
        "run": [ours, "run", str(fmu), "--isolate", "--stop", "1", "--step", "0.1"],
        "sweep": [ours, "sweep", str(fmu), "--set", "u=1,2,3", "--workers", "2", "--isolate", "--out", "study"],
        "hil hold": [ours, "hil", "hold", "--virtual", "--seconds", "1", "--rate", "50", "--out", "session"],
        "study caregivers": [
            ours,
            "study",
            "caregivers",
            "--draws",
            "2",
            "--caregivers",
            "1",
            "--seeds",
            "1",
            "--workers",
            "2",
        ],
        "studio": [sys.executable, "-I", "-c", JOB],
    }[command]


COMMANDS = (
    "build",
    "validate",
    "run",
    "sweep",
    "regress cases",
    "pytest",
    "compare",
    "hil hold",
    "study caregivers",
    "studio",
)
# They start the same children as `compare`, and go on for longer.
OTHERS_WITH_MODELS = ("diagnose", "discover", "learn")
# They start the same children as one of the others: the compilers of Modelica and C, or a robot.
OTHERS = (
    *("add", "convert", "import", "models", "regress bisect"),
    *("hil check", "hil compile", "hil identify", "hil record", "hil robot", "hil stimulate"),
)


def environment_of(folder: Path) -> Mapping[str, str]:
    """An environment with a cache of its own, so that nothing is found there."""
    return {**os.environ, "MISFIT_CACHE": str(folder.parent / "cache"), "PYTHONPATH": ""}


def fmu_that(fault: str, folder: Path) -> Path:
    """The FMU with a fault in a folder beside the working one; `none` for one without."""
    folder.mkdir(exist_ok=True)
    return faulty_fmu(folder, fault)


def decay(folder: Path) -> Path:
    """The FMU of a decay."""
    folder.mkdir(exist_ok=True)
    return Path(shutil.copy(small_fmu("decay"), folder / "decay.fmu"))


def start(arguments: list[str], folder: Path) -> "subprocess.Popen[str]":
    """Start a command in a folder."""
    return subprocess.Popen(
        arguments, cwd=folder, env=environment_of(folder), text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
