"""`misfit run` as a user sees it: lines, files and exit codes."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from faulty import faulty_fmu
from small_fmus import small_fmu

from fmus.errors import MisfitError
from orchestrator.cli.main import main
from orchestrator.results import read_result

Misfit = Callable[..., tuple[int, str, str]]
CONNECTIONS = (("mass.x", "spring.x2"), ("mass.v", "spring.v2"), ("spring.f2", "mass.fa"))


@pytest.fixture
def misfit(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Misfit:
    """Call the command in this process; gives exit code, standard output and standard error."""

    def call(*arguments: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["misfit", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        said = capsys.readouterr()
        return int(end.value.code or 0), said.out, said.err

    return call


@pytest.fixture
def pair(tmp_path: Path) -> Path:
    """The mass on a spring as a system file: m = 1 kg, k = 10 N/m, x0 = 1 m."""
    lines = ["[components]"]
    lines += [f'{name} = "{small_fmu(name)}"' for name in ("mass", "spring")]
    lines += ["[run]", "stop = 10.0", "step = 1e-4"]
    for source, target in CONNECTIONS:
        lines += ["[[connections]]", f'from = "{source}"', f'to = "{target}"']
    (tmp_path / "pair.toml").write_text("\n".join(lines))
    return tmp_path / "pair.toml"


def test_the_pair_reaches_its_published_end(misfit: Misfit, pair: Path, tmp_path: Path) -> None:
    code, said, _ = misfit("run", pair, "--out", tmp_path / "run")
    assert code == 0
    result = read_result(tmp_path / "run.parquet")
    assert result["mass.x"][-1] == pytest.approx(0.981116, abs=5e-7)
    assert len(result.time) == 100001 and result.column("mass.x").unit == "m"
    assert set(result.provenance["components"]) == {"mass", "spring"}
    assert "2 components, 3 connections, master ordered, steps of 0.0001 s" in said
    assert "kept without a connection: spring.x1 = 0.0 m (start value)" in said


def test_a_dimensionless_input_that_nothing_drives_has_no_digit_as_its_unit(misfit: Misfit) -> None:
    _, said, _ = misfit("run", "tests/cosim/arm.toml", "--stop", "0.002")

    assert "input alpha_1 = 0.0 (start value)" in said


def test_an_isolated_run_gives_the_same_bits(misfit: Misfit, pair: Path, tmp_path: Path) -> None:
    for name, flag in (("here", "--no-isolate"), ("apart", "--isolate")):
        code, said, _ = misfit("run", pair, "--out", tmp_path / f"{name}.parquet", "--stop", "0.5", flag)
        assert code == 0 and ("process of its own" in said) == (name == "apart")
    here, apart = (read_result(tmp_path / f"{name}.parquet") for name in ("here", "apart"))
    assert here.names == apart.names and (here.time == apart.time).all()
    assert all((here[name] == apart[name]).all() for name in here.names)


def test_foreign_fmus_run_apart_until_they_are_trusted(
    misfit: Misfit, pair: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MISFIT_CACHE", str(tmp_path / "cache"))
    isolated = []
    for flags in ([], ["--trust"], []):
        code, said, _ = misfit("run", pair, "--stop", "0.01", "--json", "-", *flags)
        assert code == 0
        isolated.append(json.loads(said)["isolated"])
    assert isolated == [True, False, False]


def test_values_are_set_with_units_and_differences_reported(misfit: Misfit, pair: Path, tmp_path: Path) -> None:
    misfit("run", pair, "--out", tmp_path / "a.parquet", "--stop", "1")
    code, said, _ = misfit("run", pair, "--stop", "1", "--set", "mass.x0=2000 mm", "--against", tmp_path / "a.parquet")
    assert code == 0 and "against" in said
    code, said, _ = misfit(
        "run", pair, "--stop", "1", "--set", "mass.x0=2000 mm", "--against", tmp_path / "a.parquet", "--json", "-"
    )
    found = {signal["name"]: signal for signal in json.loads(said)["against"]["signals"]}
    # The system is linear: with twice the start it is off by the whole of itself.
    assert found["mass.x"]["largest"] == pytest.approx(1.0, rel=1e-3)
    assert found["mass.x"]["parted_at"] == 0.0


def test_recorded_columns_and_points_are_chosen(misfit: Misfit, pair: Path, tmp_path: Path) -> None:
    misfit("run", pair, "--stop", "0.01", "--record", "spring.f*", "--every", "10", "--out", tmp_path / "r.csv")
    result = read_result(tmp_path / "r.csv")
    assert result.names == ("spring.f1", "spring.f2")
    assert result.time == pytest.approx([k * 1e-3 for k in range(11)], abs=1e-12)


WRONG = {
    "no file": (["nowhere.toml"], "nowhere.toml does not exist"),
    "no variable": (["PAIR", "--set", "mass.q=1"], "mass has no variable 'q'"),
    "no value": (["PAIR", "--set", "mass.m"], "--set mass.m: expected COMPONENT.VARIABLE=VALUE"),
    "wrong dimension": (["PAIR", "--set", "mass.m=1 N"], "mass.m"),
    "no pattern": (["PAIR", "--record", "leg.*"], "--record leg.* matches no variable"),
    "no format": (["PAIR", "--out", "run.mat"], "ending '.mat' is no format of results"),
    "no master": (["PAIR", "--master", "magic"], "magic"),
    "negative step": (["PAIR", "--step", "-1"], "--step -1: expected a time in s above zero"),
    "endless step": (["PAIR", "--step", "inf"], "--step inf: expected a time in s above zero"),
    "too many steps": (["PAIR", "--step", "1e-300"], "1e+301 steps of 1e-300 s from 0 to 10 s: give another --step"),
    "folder": (["PAIR", "--out", "."], ". is a folder; expected a file to write"),
    "end before begin": (["PAIR", "--stop", "-1"], "would end at -1 s"),
    "no result": (["PAIR", "--against", "gone.parquet"], "gone.parquet does not exist"),
    "no swap": (["PAIR", "--swap", "mass"], "--swap mass: expected COMPONENT=FILE.fmu"),
}


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("isolate", ["--isolate", "--no-isolate"])
def test_wrong_usage_is_one_line_and_exit_code_2(misfit: Misfit, pair: Path, kind: str, isolate: str) -> None:
    arguments, words = WRONG[kind]
    code, _, said = misfit("run", *[pair if a == "PAIR" else a for a in arguments], isolate)
    assert code == 2
    assert words in said and said.startswith("misfit: ") and said.count("\n") == 1


def test_a_crash_keeps_the_rows_until_then_and_exits_with_3(misfit: Misfit, tmp_path: Path) -> None:
    fmu = faulty_fmu(tmp_path, "segfault")
    code, _, said = misfit("run", fmu, "--out", tmp_path / "run.parquet")
    assert code == 3
    assert "FMU 'segfault' crashed in step at t = 0.5 s: segmentation fault" in said
    assert f"51 rows until then are in {tmp_path}/run.parquet" in said
    result = read_result(tmp_path / "run.parquet")
    assert result.time == pytest.approx([0.01 * k for k in range(51)])
    assert "segmentation fault" in result.failure and not result.complete


def rows_so_far(path: Path) -> int:
    """Rows that a run has handed to the operating system (the size of its file does not tell: a batch may be half)."""
    try:
        return len(read_result(path).time)
    except MisfitError:
        return 0


def test_a_killed_run_leaves_its_rows(pair: Path, tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "orchestrator.cli",
        "run",
        str(pair),
        "--realtime",
        "1",
        "--out",
        str(tmp_path / "run.h5"),
    ]
    root = Path(__file__).parents[2]
    process = subprocess.Popen(
        command, cwd=root, env={**os.environ, "PYTHONPATH": str(root)}, stdout=subprocess.DEVNULL
    )
    while process.poll() is None and rows_so_far(tmp_path / "run.h5") <= 100:
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    assert process.wait(timeout=60) == -signal.SIGKILL
    result = read_result(tmp_path / "run.h5")
    assert len(result.time) > 100 and not result.complete
    assert result["mass.x"][0] == 1.0


def hear_interrupts() -> None:
    """Take SIGINT even where tests run in the background of a shell, which ignores it; and never fill a disk."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2**30, 2**30))


@pytest.mark.parametrize("isolate", ["--isolate", "--no-isolate"])
def test_an_endless_run_ends_by_ctrl_c_with_a_whole_file(pair: Path, tmp_path: Path, isolate: str) -> None:
    root, out = Path(__file__).parents[2], tmp_path / "run.parquet"
    command = [sys.executable, "-m", "orchestrator.cli", "run", str(pair), "--stop", "inf", "--out", str(out), isolate]
    process = subprocess.Popen(
        command,
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root)},
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=hear_interrupts,
    )
    journal = tmp_path / "run.parquet.unfinished"
    while process.poll() is None and not (journal.exists() and journal.stat().st_size > 1_000_000):
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=60)[1].strip() == "misfit: interrupted"
    assert process.returncode == 130
    result = read_result(out)
    assert len(result.time) > 10_000 and result.failure == "interrupted"
    assert not journal.exists()


def test_nothing_is_printed_when_quiet(misfit: Misfit, pair: Path) -> None:
    assert misfit("run", pair, "--stop", "0.01", "--quiet") == (0, "", "")


def test_a_swap_that_fits_is_reported_and_run(misfit: Misfit, pair: Path, tmp_path: Path) -> None:
    misfit("run", pair, "--stop", "1", "--out", tmp_path / "a.parquet")
    other = small_fmu("spring", version=3)
    code, said, _ = misfit("run", pair, "--stop", "1", "--swap", f"spring={other}", "--against", tmp_path / "a.parquet")
    assert code == 0
    assert "swap spring:" in said and "the swap works" in said
    assert "no signal parts by more than 1e-06 of its range" in said


RANGE = {'<Real start="0" unit="m"/>': '<Real start="0" unit="m" min="-2" max="6"/>'}


@pytest.mark.parametrize(("declared", "expected"), [(RANGE, (-2.0, 6.0)), ({}, (-1.0, 1.0))])
def test_excited_inputs_show_what_a_swap_changes_and_resting_ones_say_so(
    misfit: Misfit, tmp_path: Path, declared: dict[str, str], expected: tuple[float, float]
) -> None:
    old, new = small_fmu("spring", replace=declared), small_fmu("spring", version=3)
    swap = ("--swap", f"spring={new}", "--set", "spring.k=12")
    for name, more in (("rest", ()), ("moved", ("--excite",))):
        misfit("run", old, "--step", "0.01", *more, "--out", tmp_path / f"{name}.parquet")

    _, rest, _ = misfit("run", old, "--step", "0.01", *swap, "--against", tmp_path / "rest.parquet")
    assert "nothing was exercised: no signal moved" in rest and "no signal parts" not in rest

    arguments = ("--step", "0.01", "--excite", "--against", tmp_path / "moved.parquet", "--json", "-")
    _, moved, _ = misfit("run", old, *arguments, *swap)
    found = json.loads(moved)
    assert found["excited"] == ["x1", "v1", "x2", "v2"]
    drive = found["signals"]["inputs_of_the_case.x1"]
    assert (drive["min"], drive["max"]) == pytest.approx(expected, rel=1e-3)
    assert found["against"]["exercised"] and not found["against"]["same"]
    assert [signal["name"] for signal in found["against"]["signals"]] == ["spring.f1", "spring.f2"]
    # k goes from 10 to 12 N/m at rest of the damper, so both forces grow by a fifth.
    force = found["against"]["signals"][0]
    assert force["largest"] / force["spread"] == pytest.approx(
        0.2 * largest_share(tmp_path / "moved.parquet"), rel=1e-3
    )

    _, same, _ = misfit("run", old, "--step", "0.01", "--excite", *swap[:2], "--against", tmp_path / "moved.parquet")
    assert "no signal parts by more than 1e-06 of its range" in same


def largest_share(path: Path) -> float:
    """The largest force of a spring as a share of its range."""
    force = read_result(path)["spring.f1"]
    return float(max(abs(force)) / (max(force) - min(force)))


def test_inputs_that_are_driven_or_have_a_value_stay(misfit: Misfit, pair: Path) -> None:
    _, said, _ = misfit("run", pair, "--stop", "0.1", "--excite", "--set", "spring.x1=0.5", "--json", "-")
    assert json.loads(said)["excited"] == ["mass.fb", "spring.v1"]
    assert misfit("run", pair, "--stop", "inf", "--excite")[::2] == (
        2,
        "misfit: --excite needs the end of the run; give a stop time in s, such as --stop 10\n",
    )


def test_a_swap_that_cannot_work_says_why_before_running(misfit: Misfit, pair: Path, tmp_path: Path) -> None:
    code, _, said = misfit("run", pair, "--swap", f"spring={small_fmu('ball')}", "--out", tmp_path / "r.csv")
    assert code == 2 and said.startswith("misfit: swap of spring cannot work: ")
    assert not (tmp_path / "r.csv").exists()


RENAMED = {'name="f2"': 'name="force2"'}


def test_similar_names_need_the_users_word(misfit: Misfit, pair: Path, tmp_path: Path) -> None:
    other = small_fmu("spring", replace=RENAMED)
    code, _, said = misfit("run", pair, "--stop", "0.1", "--swap", f"spring={other}")
    assert code == 2 and "f2" in said and "force2" in said
    names = tmp_path / "names.toml"
    code, _, said = misfit("run", pair, "--stop", "0.1", "--swap", f"spring={other}", "--mapping", names)
    assert code == 2 and "has been written; check its names" in said
    names.write_text('[spring]\nf2 = "force2"\n')
    code, said, _ = misfit("run", pair, "--stop", "0.1", "--swap", f"spring={other}", "--mapping", names, "--json", "-")
    assert code == 0
    assert "spring.force2" in json.loads(said)["signals"]


def test_a_paced_run_says_how_late_it_was(misfit: Misfit, pair: Path) -> None:
    code, said, _ = misfit(
        "run", pair, "--stop", "0.02", "--step", "1e-3", "--realtime", "1", "--json", "-", "--no-isolate"
    )
    assert code == 0
    paced = json.loads(said)
    assert paced["realtime"]["points"] == 20 and paced["realtime"]["factor"] == 1.0
    assert paced["seconds"] >= 0.02  # the clock is never overtaken
    code, _, said = misfit("run", pair, "--realtime", "0", "--no-isolate")
    assert code == 2 and "--realtime 0: expected simulated seconds for each second" in said


def test_a_sweep_is_counted_and_goes_on(misfit: Misfit, pair: Path, tmp_path: Path) -> None:
    out = tmp_path / "study"
    arguments = ("sweep", pair, "--out", out, "--set", "mass.m=linspace(1,2,3) kg", "--stop", "0.01", "--workers", "1")
    code, said, _ = misfit(*arguments)
    assert code == 0 and said.startswith("3 runs: 3 in ")
    code, said, _ = misfit(*arguments, "--json", "-")
    document = json.loads(said)
    assert code == 0 and document["done_before"] == 3
    assert [run["varied"] for run in document["runs"]] == [{"mass.m": f"{m} kg"} for m in (1.0, 1.5, 2.0)]


def test_a_sweep_with_a_failed_run_exits_with_3(misfit: Misfit, pair: Path, tmp_path: Path) -> None:
    code, said, _ = misfit(
        "sweep", pair, "--out", tmp_path / "study", "--set", "mass.m=1,red", "--stop", "0.01", "--workers", "1"
    )
    assert code == 3 and "run 1 failed: mass.m" in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--set", "mass.m"], "--set mass.m: expected NAME=VALUES"),
        (["--seeds", "many"], "--seeds many: expected a number of seeds"),
        (["--set", "mass.m=linspace(1,2)"], "a range that cannot be read"),
        (["--set", "mass.q=1,2"], "mass has no variable 'q'"),
        (["--set", "mass.m=1,2", "--scheduler", "tcp://127.0.0.1:1"], "no Dask scheduler answers"),
    ],
)
def test_wrong_usage_of_sweep_is_one_line(
    misfit: Misfit, pair: Path, tmp_path: Path, arguments: list[str], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("orchestrator.cluster.ANSWER_S", 0.2)
    code, _, said = misfit("sweep", pair, "--out", tmp_path / "study", "--workers", "1", *arguments)
    assert code == 2 and words in said and said.count("\n") == 1
