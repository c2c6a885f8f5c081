"""No command imports from the working folder: a user's own `queue.py` or `orchestrator.py` there stays unread."""

import re
from pathlib import Path

import pytest
from commands import COMMANDS, ROOT, arguments_of, decay, fmu_that, start

from fmus.children.boot import search_path
from fmus.children.start import handed_over

POISON = 'from pathlib import Path\nwith Path("{marker}").open("a") as file:\n    file.write(__file__ + "\\n")\nraise SystemExit("poisoned")\n'
OURS = ("orchestrator.py", "hil.py", "fmus/__init__.py", "misfit_user.py")
STANDARD = ("queue.py", "random.py", "tempfile.py", "selectors.py", "pickle.py")


# The study, which takes a minute, starts its children as a sweep does.
@pytest.mark.parametrize("command", [command for command in COMMANDS if command != "study caregivers"])
def test_a_command_runs_nothing_of_the_working_folder(command: str, tmp_path: Path) -> None:
    working, marker = tmp_path / "working", tmp_path / "executed"
    working.mkdir()
    # `python -m pytest` itself reads the working folder first, so that only our own names can be poisoned there.
    for name in OURS if command == "pytest" else (*OURS, *STANDARD):
        (working / name).parent.mkdir(exist_ok=True)
        (working / name).write_text(POISON.format(marker=marker))
    fmu = (
        decay(tmp_path / "models") if command in ("regress cases", "pytest") else fmu_that("none", tmp_path / "models")
    )

    process = start(arguments_of(command, working, fmu), working)
    output, errors = process.communicate(timeout=300)

    assert not marker.exists(), marker.read_text()
    assert process.returncode in (0, 1), errors
    assert "Traceback" not in output + errors and "poisoned" not in output + errors


def test_the_standard_library_and_our_packages_go_before_what_a_user_adds() -> None:
    path = search_path(["/lib/python311.zip", "/lib/site-packages"], ["/site", "/home/me/project"])
    assert path == ["/lib/python311.zip", "/site", "/home/me/project", "/lib/site-packages"]
    assert handed_over(["", ".", "/tmp/mine", "/x"], Path("/tmp/mine"), Path("/site")) == [
        "/site",
        str(Path().absolute()),
        "/x",
    ]


def test_no_room_starts_python_on_its_own() -> None:
    """Whoever needs a child process asks `fmus.children`, which starts it isolated and lets it end with its parent."""
    alone = re.compile(
        r"sys\.executable|ProcessPoolExecutor|get_context|os\.fork|subprocess\.(run|call|check_)|shell=True"
    )
    found = [
        f"{file.relative_to(ROOT)}: {line.strip()}"
        for room in ("fmus", "orchestrator", "hil")
        for file in (ROOT / room).rglob("*.py")
        if "children" not in file.parts
        for line in file.read_text().splitlines()
        if alone.search(line)
    ]
    assert found == []
