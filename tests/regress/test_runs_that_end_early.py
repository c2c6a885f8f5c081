"""An FMU may end a run by itself: a case passes where its reference ends there, and fails where it goes on."""

from pathlib import Path

from cases_of_balls import case_file, fmu, misfit

STAIR = 'model = "stair.fmu"\nreference = "stair.csv"\n[run]\nstop = 20.0\nstep = 0.5\n'


def test_a_reference_that_ends_with_the_run_is_enough_and_a_longer_one_is_not(tmp_path: Path) -> None:
    fmu(tmp_path, "stair", interfaces=("CoSimulation",))
    case_file(tmp_path, "stair", STAIR)

    assert misfit("--update", folder=tmp_path).returncode == 0
    done = misfit(folder=tmp_path)
    assert done.returncode == 0, done.stdout

    rows = (tmp_path / "stair.csv").read_text()
    (tmp_path / "stair.csv").write_text(rows + "12.0,10\n15.0,10\n20.0,10\n")
    longer = misfit(folder=tmp_path)
    assert longer.returncode == 1 and "counter" in longer.stdout
