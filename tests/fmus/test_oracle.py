"""Our FMUs against rumoca's own simulator: the same front end, but another back end and another integrator."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from oracle_cases import NAMES, POINTS, assert_same_course, case

from fmus.library import library_root

CHILD = Path(__file__).with_name("rumoca_oracle.py")
TIME_LIMIT_S = 120


@pytest.fixture(scope="session")
def oracle(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, list[float]]]:
    """What rumoca gets for each case, every variable by its name."""
    folder = tmp_path_factory.mktemp("oracle")
    jobs = [{"source": c.source, "model": c.simulated, "stop": c.stop, "points": POINTS} for c in map(case, NAMES)]
    (folder / "jobs.json").write_text(json.dumps(jobs))
    command = [sys.executable, str(CHILD), str(library_root()), str(folder / "jobs.json"), str(folder / "results")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False)
    found = [json.loads(line) for line in (folder / "results").read_text().splitlines()]
    at = NAMES[len(found)] if len(found) < len(NAMES) else "the end"
    assert done.returncode == 0, f"rumoca at {at}: {done.returncode} {done.stderr[-2000:]}"
    return dict(zip(NAMES, found, strict=True))


@pytest.mark.parametrize("name", NAMES)
def test_every_variable_takes_the_course_that_rumoca_computes(
    name: str, oracle: dict[str, dict[str, list[float]]], tmp_path: Path
) -> None:
    assert_same_course(case(name), oracle[name], tmp_path, least_share=0.9)
