"""The command line as a user meets it: one line for a mistake, the right exit code, results in files."""

import fcntl
import json
import os
import re
import shutil
import struct
import subprocess
import sys
import termios
import time
import zipfile
from contextlib import suppress
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from fmus.files import write_atomically
from tests.in_process import misfit_here

CASES = Path(__file__).parent / "cases"
ARM = CASES / "arm" / "case_003"
PENDULUM = CASES / "pendulum"  # takes a third of the time


def misfit(*arguments: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [str(Path(sys.executable).with_name("misfit")), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False, timeout=300)


def on_a_terminal(columns: int, *arguments: str | Path, code: int = 0) -> str:
    """What a terminal of that width shows, without its control codes and what was drawn over; errors where one is expected."""
    ours, theirs = os.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    command = [str(Path(sys.executable).with_name("misfit")), *map(str, arguments)]
    environment = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    process = subprocess.Popen(command, stdout=theirs, stderr=theirs if code else subprocess.DEVNULL, env=environment)
    os.close(theirs)
    shown = b""
    with suppress(OSError):  # Linux ends a closed terminal with an error
        while part := os.read(ours, 65536):
            shown += part
    os.close(ours)
    assert process.wait(timeout=60) == code
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.decode()).replace("\r\n", "\n")


def test_an_error_breaks_between_words_on_a_terminal() -> None:
    lines = on_a_terminal(60, "ledger", "no-such-folder", code=2).splitlines()

    assert len(lines) > 1 and max(map(len, lines)) <= 60
    assert "give the folder that 'misfit discover --out' wrote" in " ".join(lines)


def small_case(folder: Path, **changes: str) -> Path:
    """Two short trials cut from a shipped case; `changes` replace text in case.toml."""
    folder.mkdir()
    for name in ("trial_01.csv", "trial_05.csv"):
        lines = (ARM / name).read_text().splitlines(keepends=True)
        (folder / name).write_text("".join(lines[:501]))
    text = (ARM / "case.toml").read_text()
    text = text.replace(
        next(line for line in text.splitlines() if line.startswith("files")), 'files = ["trial_01.csv", "trial_05.csv"]'
    )
    text = text.replace("learning = [1, 2, 3, 4]", "learning = [1]").replace("held_out = [5, 6]", "held_out = [2]")
    for old, new in changes.items():
        text = text.replace(old, new)
    (folder / "case.toml").write_text(text)
    return folder


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fmu")
    done = misfit("build", "pendulum", "--out", folder)
    assert done.returncode == 0, done.stderr
    return folder / "pendulum.fmu"


@pytest.mark.parametrize("rest", ["", ', "effects": [{}]', ', "effects": [1], "model": "arm"'])
def test_a_damaged_diagnosis_is_told_in_one_line(rest: str, tmp_path: Path) -> None:
    (tmp_path / "d.json").write_text(f'{{"schema": "misfit.diagnosis/1"{rest}}}')

    done = misfit_here("add", tmp_path / "d.json")

    assert done.returncode == 2
    assert "is damaged" in done.stderr and "Traceback" not in done.stderr


def test_help_says_of_every_command_what_it_does() -> None:
    listed = misfit("--help").stdout.split("Commands:")[1].splitlines()

    rows = [line.split(maxsplit=1) for line in listed if line.strip()]
    assert {row[0] for row in rows} == {entry.name for entry in entry_points(group="misfit.commands")}
    assert all(len(row) == 2 for row in rows), "a command without a summary"


MISTAKES = {
    "unknown command": (["comparre"], "did you mean 'compare'?"),
    "missing argument": (["compare", "arm"], "Missing argument 'DATA'"),
    "unknown model": (["compare", "leg", str(ARM)], "there is no model 'leg'; built-in models are arm,"),
    "missing data": (["compare", "arm", "nowhere"], "nowhere: does not exist"),
    "missing FMU": (["compare", "nowhere.fmu", str(ARM)], "nowhere.fmu"),
    "missing FMU for a diagnosis": (["diagnose", "some.fmu", str(ARM)], "FMU some.fmu cannot be read"),
    "data of another model": (["diagnose", "arm", str(CASES / "rat_muscle")], "no column is an output of the model"),
    "class without a name": (["compare", "model.mo", str(ARM)], "write model.mo:Package.Class"),
    "no ledger": (["ledger", str(CASES)], "has no ledger.jsonl"),
    "report below a file": (["compare", "arm", str(ARM), "--html", str(Path(__file__) / "x.html")], "is no folder"),
    "result onto a folder": (["study", "caregivers", "--json", str(CASES)], "is a folder; expected a file"),
    "unknown effect": (["add", "gravity", "--to", "arm"], "there is no effect 'gravity'; the library has"),
    "effect without a model": (["add", "payload"], "--to MODEL"),
    "effect without a slot": (["add", "payload", "--to", "rat-muscle"], "has no free slot for payload"),
    "unwritable result": (["compare", "pendulum", str(PENDULUM), "--json", "/proc/none/x.json"], "/proc/none/x.json"),
}

# One that the command line itself finds, one that a command does.
AS_PROCESSES = ("unknown command", "missing data")


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistake_ends_with_code_2_and_one_line_that_helps(mistake: str) -> None:
    arguments, words = MISTAKES[mistake]

    done = misfit(*arguments) if mistake in AS_PROCESSES else misfit_here(*arguments)

    assert done.returncode == 2
    assert words in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert "Traceback" not in done.stderr + done.stdout


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda path: path.write_bytes(b"not a zip"), "zip"),
        (lambda path: path.write_bytes(path.read_bytes()[:2000]), "zip"),
        (lambda path: zipfile.ZipFile(path, "w").writestr("readme.txt", "x"), "modelDescription.xml"),
        (lambda path: zipfile.ZipFile(path, "w").writestr("modelDescription.xml", "<fmiModelDescription"), "XML"),
        (lambda path: zipfile.ZipFile(path, "w").writestr("../escape", "x"), "escape"),
    ],
)
def test_broken_fmu_ends_with_code_2_and_one_line(damage: object, words: str, fmu: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.fmu"
    shutil.copy(fmu, broken)
    damage(broken)  # type: ignore[operator]

    done = misfit_here("compare", broken, PENDULUM)

    assert done.returncode == 2
    assert words.lower() in done.stderr.lower()
    assert "broken.fmu" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_unit_of_another_dimension_names_both_units(tmp_path: Path) -> None:
    data = small_case(tmp_path / "case", **{'q1 = "rad"': 'q1 = "N"'})

    done = misfit_here("compare", "arm", data)

    assert done.returncode == 2
    assert "q1" in done.stderr
    assert "rad" in done.stderr
    assert "N" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_degrees_in_the_data_give_the_same_errors_as_radians(tmp_path: Path) -> None:
    plain = small_case(tmp_path / "rad")
    scaled = small_case(tmp_path / "deg", **{'q1 = "rad"': 'q1 = "deg"'})
    for name in ("trial_01.csv", "trial_05.csv"):
        rows = [line.split(",") for line in (scaled / name).read_text().splitlines()]
        column = rows[0].index("q1")
        for row in rows[1:]:
            row[column] = repr(float(row[column]) * 180 / 3.141592653589793)
        (scaled / name).write_text("\n".join(",".join(row) for row in rows) + "\n")

    first, second = (
        json.loads(misfit_here("compare", "arm", folder, "--json", "-", "--quiet").stdout) for folder in (plain, scaled)
    )

    assert second["learning"]["rmse"]["q1"] == pytest.approx(first["learning"]["rmse"]["q1"], rel=1e-3)


def test_compare_writes_the_documented_json_and_a_report(tmp_path: Path) -> None:
    data = small_case(tmp_path / "case")

    done = misfit_here("compare", "arm", data, "--json", tmp_path / "c.json", "--html", tmp_path / "c.html")

    assert done.returncode == 0, done.stderr
    document = json.loads((tmp_path / "c.json").read_text())
    assert document["schema"] == "misfit.compare/1"
    assert document["signals"] == ["q1", "q2"]
    assert [trial["set"] for trial in document["trials"]] == ["learning", "held_out"]
    assert set(document["where"]) == {"signal", "time", "state", "frequency"}
    squares = [(document["learning"]["rmse"][s] / document["noise_floor"][s]) ** 2 for s in ("q1", "q2")]
    assert document["learning"]["over_floor"] == pytest.approx((sum(squares) / 2) ** 0.5)
    html = (tmp_path / "c.html").read_text()
    assert "<img" in html
    assert 'src="http' not in html


def test_fmu_and_modelica_model_show_the_same_error(tmp_path: Path) -> None:
    assert misfit("build", "arm", "--out", tmp_path).returncode == 0
    documents = [
        json.loads(misfit("compare", model, ARM, "--json", "-", "--quiet").stdout)
        for model in ("arm", str(tmp_path / "arm.fmu"))
    ]

    for signal in ("q1", "q2"):
        errors = [document["held_out"]["rmse"][signal] for document in documents]
        assert errors[1] == pytest.approx(errors[0], rel=0.02)  # start values are bounded alike, not identically


def test_discover_then_ledger_then_a_second_run_that_adds_nothing(tmp_path: Path) -> None:
    out = tmp_path / "results"
    first = misfit("discover", "arm", ARM, "--out", out, "--json", tmp_path / "d.json", "--html", tmp_path / "d.html")
    assert first.returncode == 0, first.stderr
    diagnosis = json.loads((tmp_path / "d.json").read_text())
    assert diagnosis["verdict"] == "named"
    assert Path(diagnosis["patched_model"]).name == "Arm_1.fmu"
    lines = (out / "ledger.jsonl").read_text().splitlines()
    assert len(lines) == 2

    again = misfit("discover", "arm", ARM, "--out", out)
    listed = json.loads(misfit("ledger", out, "--json", "-").stdout)

    assert again.returncode == 0
    assert (out / "ledger.jsonl").read_text().splitlines() == lines
    falling = [entry["held_out"]["over_floor"] for entry in listed["versions"]]
    assert falling[1] < falling[0] / 10
    text = (out / "Arm_1.mo").read_text()
    assert "extends FESArm.Arms.Arm(" in text
    checked = misfit("validate", out / "Arm_1.fmu")
    assert (checked.returncode, checked.stdout) == (0, "1 FMU without findings\n")
    # The written class is a model like any other.
    after = json.loads(misfit("compare", f"{out / 'Arm_1.mo'}:Arm_1", ARM, "--json", "-", "--quiet").stdout)
    assert after["held_out"]["rmse"]["q1"] == pytest.approx(diagnosis["held_out"]["rmse_after"]["q1"], rel=1e-3)


def test_add_writes_the_diagnosed_effect_and_leaves_the_original_alone(tmp_path: Path) -> None:
    diagnosis = tmp_path / "diagnosis.json"
    assert misfit("diagnose", "rat-muscle", CASES / "rat_muscle", "--json", diagnosis, "--quiet").returncode == 0

    done = misfit("add", diagnosis, "--out", tmp_path)

    assert done.returncode == 0, done.stderr
    fitted = json.loads(diagnosis.read_text())["effects"]
    delay = next(e for e in fitted if e["id"] == "stimulation_delay")["parameters"]["T"]["value"]
    assert f"stimulationPath1(T={delay!r})" in (tmp_path / "RatGastrocnemius_1.mo").read_text()
    assert (tmp_path / "RatGastrocnemius_1.fmu").exists()


def test_results_survive_kill_9_in_the_middle(tmp_path: Path) -> None:
    """A run that is killed leaves no half-written files under their final names."""
    out = tmp_path / "results"
    assert misfit("discover", "arm", ARM, "--out", out, "--quiet").returncode == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    for delay in (0.5, 1.5, 3.0):
        command = [str(Path(sys.executable).with_name("misfit")), "discover", "arm", str(ARM), "--out", str(out)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(delay)  # let it get somewhere; any moment will do
        process.kill()
        process.wait(timeout=60)

    after = {path.name: path.read_bytes() for path in out.iterdir() if not path.name.startswith(".")}
    assert after == before


def test_help_answers_without_loading_the_heavy_packages() -> None:
    code = (
        "import sys; sys.argv = ['misfit', '--help']\n"
        "from orchestrator.cli.main import main\n"
        "try:\n    main()\nexcept SystemExit as stop:\n    assert not stop.code\n"
        "print(sorted(set(sys.modules) & {'casadi', 'numpy', 'scipy', 'matplotlib', 'rumoca', 'fmpy'}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert done.stdout.splitlines()[-1] == "[]"


def test_warnings_of_libraries_are_not_for_users_unless_they_ask() -> None:
    """An overflow in a candidate that diverges stood between the lines of an answer."""
    code = (
        "import warnings, misfit_start, orchestrator.cli.main as m\n"
        "m.misfit.main = lambda **k: warnings.warn('overflow', RuntimeWarning)\nmisfit_start.command()"
    )
    said = [
        subprocess.run([sys.executable, *options, "-c", code], capture_output=True, text=True, check=True).stderr
        for options in ([], ["-W", "default"])
    ]
    assert said[0] == "" and "RuntimeWarning: overflow" in said[1]


def test_output_in_a_pipe_has_no_control_characters() -> None:
    done = misfit("compare", "pendulum", PENDULUM)

    assert "\x1b" not in done.stdout + done.stderr
    assert done.stderr == ""


def test_models_lists_every_built_in() -> None:
    assert [line.split()[0] for line in misfit("models").stdout.splitlines() if line[0] != " "] == [
        "arm",
        "arm-paper",
        "arm-without-muscles",
        "arm-muscle",
        "muscle",
        "rat-muscle",
        "pendulum",
        "drive",
        "linear-drive",
        "cart",
        "two-mass",
        "double-pendulum",
        "tanks",
    ]


def test_environment_with_a_missing_compiler_says_so(tmp_path: Path) -> None:
    environment = {**os.environ, "PATH": str(tmp_path), "MISFIT_CACHE": str(tmp_path / "cache")}
    environment.pop("CC", None)
    command = [sys.executable, "-m", "orchestrator.cli", "compare", "pendulum", str(PENDULUM)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)

    assert done.returncode == 2
    assert "no C compiler found" in done.stderr


def test_models_lists_what_goes_in_and_out() -> None:
    lines = misfit("models").stdout.splitlines()
    drive = next(place for place, line in enumerate(lines) if line.startswith("drive "))

    assert lines[drive + 1 : drive + 3] == ["  inputs: torque (N.m)", "  outputs: phi (rad)"]


def test_one_long_step_off_a_terminal_says_now_and_then_where_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """A line came with the next step only: a comparison of ten minutes said nothing."""
    from orchestrator.cli.common import _now_and_then

    said = ""
    with _now_and_then(every_s=0.02) as say:
        say("running sensor_lag along every trial")
        while said.count("\n") < 3:
            said += capsys.readouterr().err

    assert all(
        re.fullmatch(r"misfit: \d+ s.*: running sensor lag along every trial", line) for line in said.splitlines()
    )
    time.sleep(0.05)
    assert capsys.readouterr().err.count("\n") <= 1, "it is quiet once the work has ended"


def shell(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    given = {**os.environ, "MISFIT": str(Path(sys.executable).with_name("misfit"))}
    return subprocess.run(["bash", "-c", line], cwd=folder, env=given, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_a_command_runs_without_standard_streams_as_daemons_start_it(closed: str, fmu: Path, tmp_path: Path) -> None:
    """Pipes to the child of an isolated run would have their numbers."""
    shutil.copy(fmu, tmp_path / "x.fmu")

    done = shell(f'"$MISFIT" run x.fmu --isolate --stop 1 --step 0.1 --out x.csv {closed}', tmp_path)

    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "x.csv").read_text().splitlines()) == 12


def test_a_working_folder_that_is_gone_is_told_in_one_line(tmp_path: Path) -> None:
    done = shell('mkdir gone; cd gone; rmdir ../gone; "$MISFIT" models', tmp_path)

    assert (done.returncode, done.stderr) == (2, "misfit: the working folder is gone; change to one that exists\n")


def test_devices_and_pipes_are_written_to_and_stay(tmp_path: Path) -> None:
    """As root `--json /dev/null` had replaced the device by a file."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reading = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_atomically(pipe, b"{}")
        assert os.read(reading, 10) == b"{}" and pipe.is_fifo()
    finally:
        os.close(reading)


def test_no_line_of_a_run_is_wider_than_the_terminal_which_would_break_it_within_a_number() -> None:
    lines = on_a_terminal(60, "run", "pendulum", "--stop", "1").splitlines()

    assert any("times real time" in line for line in lines)
    assert max(len(line.rpartition("\r")[2].rstrip()) for line in lines) <= 60
