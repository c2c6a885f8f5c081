"""Jobs run in process groups of their own, and all that is known about them is on disk."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from fmus.errors import MisfitError
from orchestrator.studio import jobs
from orchestrator.studio.project import Project
from orchestrator.studio.workspace import Workspace

# In the place of a job's program: a child with a child of its own, neither of which ends by itself.
ENDLESS = """
import subprocess, sys, time, pathlib
other = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
pathlib.Path("job/progress.txt").write_text(f"{other.pid}\\n")
time.sleep(600)
"""


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Workspace(tmp_path).create("a project")


@pytest.fixture
def endless(project: Project, monkeypatch: pytest.MonkeyPatch) -> Project:
    """A project with a job that runs on."""
    monkeypatch.setattr(jobs, "PROGRAM", (sys.executable, "-c", ENDLESS))
    jobs.start(project, "diagnose")
    wait_for(lambda: jobs.look(project).message.isdigit())
    return project


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline, "it did not happen within 20 s"
        time.sleep(0.02)


def is_running(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def finished(project: Project) -> jobs.Job:
    wait_for(lambda: not jobs.look(project).running)
    return jobs.look(project)


def test_cancel_ends_the_children_of_the_job_too(endless: Project) -> None:
    grandchild = int(jobs.look(endless).message)

    jobs.cancel(endless)

    wait_for(lambda: not is_running(grandchild))
    assert jobs.look(endless).state == "cancelled"


def test_another_server_sees_a_job_that_runs_and_can_cancel_it(endless: Project) -> None:
    code = (
        "import sys; from pathlib import Path; from orchestrator.studio import jobs;"
        "from orchestrator.studio.project import Project; p = Project(Path(sys.argv[1]));"
        "print(jobs.look(p).state); jobs.cancel(p); print(jobs.look(p).state)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(endless.folder)], capture_output=True, text=True, check=True)

    assert done.stdout.split() == ["running", "cancelled"]


def test_project_runs_one_job_at_a_time(endless: Project) -> None:
    with pytest.raises(MisfitError, match="another job of this project is running"):
        jobs.start(endless, "compare")
    jobs.cancel(endless)


def test_job_that_is_killed_from_outside_is_told_as_failed(endless: Project) -> None:
    os.killpg(os.getpgid(int(jobs.look(endless).message)), signal.SIGKILL)

    found = finished(endless)

    assert found.state == "failed" and "ended without a result" in found.message


def test_error_of_a_job_is_the_one_line_of_the_command_line(project: Project) -> None:
    (project.measurements / "case.toml").write_text('files = ["trial.csv"]\n')
    (project.measurements / "trial.csv").write_text("time,q\n0,0\n0.1,banana\n")

    jobs.start(project, "match")
    found = finished(project)

    assert found.state == "failed" and "\n" not in found.message
    assert "banana" in found.message and "trial.csv" in found.message and "line 3" in found.message


def test_case_file_cannot_lead_to_files_outside_the_project(project: Project, tmp_path: Path) -> None:
    (tmp_path / "secret.csv").write_text("time,q\n0,0\n1,1\n")
    (project.measurements / "case.toml").write_text('files = ["../../../secret.csv"]\n')

    jobs.start(project, "match")
    found = finished(project)

    assert found.state == "failed" and "outside the project" in found.message


def test_columns_that_do_not_fit_stand_in_the_table_beside_those_that_do(project: Project) -> None:
    (project.measurements / "trial.csv").write_text(
        "time,torque,w,phi\n" + "".join(f"{k / 10},1,2,3\n" for k in range(30))
    )
    (project.measurements / "case.toml").write_text(
        'files = ["trial.csv"]\n[columns]\ntime = "s"\ntorque = "kg"\nw = "1"\nphi = "deg"\n'
    )
    project.change(model="drive")

    jobs.start(project, "match")
    assert finished(project).state == "done"

    found = project.result("match.json")
    assert found is not None and "torque" in found["problem"] and "kg" in found["problem"]
    rows = {row["column"]: row["conversion"] for row in found["columns"]}
    assert rows["torque"].startswith("impossible")
    assert rows["phi"] == "times 0.0174533"  # pi / 180
    assert rows["w"] == ""
