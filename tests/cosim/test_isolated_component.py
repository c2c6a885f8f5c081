"""What an FMU does wrong in a process of its own is an error here that names it and the simulated time."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from faulty import faulty_fmu, held, left_behind

from fmus.errors import ComponentError
from orchestrator.cosim import ComponentSpec
from orchestrator.cosim.isolate.component import IsolatedComponent
from orchestrator.cosim.isolate.process import ChildLimits

# Seconds are generous for all but the endless loop; half a GiB is more than Python needs and less than 10 GB.
USUAL, HASTY = ChildLimits(60.0, 0.5), ChildLimits(1.0, 0.5)


@pytest.fixture
def handles() -> Iterator[None]:
    """Every test leaves as many open files and children as it found."""
    before = held()
    yield
    assert not left_behind(before)


def _run(folder: Path, fault: str, limits: ChildLimits = USUAL) -> float:
    """Integrate u = 1 m/s for 1 s in steps of 0.01 s."""
    faulty_fmu(folder, fault)
    component = IsolatedComponent(ComponentSpec("tank", "fmu", f"{fault}.fmu"), folder, limits)
    try:
        component.initialise(0.0, 1.0, None)
        component.start()
        for k in range(100):
            component.set(["u"], [1.0])
            component.step(k * 0.01, 0.01)
        return component.get(["y"])[0]
    finally:
        component.terminate()


def test_a_sound_fmu_gives_what_it_gives_in_the_host(tmp_path: Path, handles: None) -> None:
    assert _run(tmp_path, "none") == pytest.approx(1.0, abs=1e-12)


AT_HALF = "in step at t = 0.5 s"
FATES = {
    "segfault": f"FMU 'tank' crashed {AT_HALF}: segmentation fault",
    "abort": f"FMU 'tank' crashed {AT_HALF}: abort(); last good time 0.5 s; it said: solver: matrix is singular",
    "exit": f"FMU 'tank' ended its process {AT_HALF}: exit(0)",
    "stack": f"FMU 'tank' crashed {AT_HALF}: segmentation fault (a bad pointer, or the stack ran over)",
    "divide": f"FMU 'tank' crashed {AT_HALF}: division of an integer by zero",
    "initialise_segfault": "FMU 'tank' crashed in initialise at t = 0 s: segmentation fault",
    "memory": "FMU 'tank' took 0.",
    "close_all": "FMU 'tank' ended its process in step",
}


@pytest.mark.parametrize("fault", FATES)
def test_the_end_of_a_process_is_an_error_with_fmu_and_time(fault: str, tmp_path: Path, handles: None) -> None:
    with pytest.raises(ComponentError) as caught:
        _run(tmp_path, fault)
    assert FATES[fault] in str(caught.value)


def test_an_endless_loop_is_stopped(tmp_path: Path, handles: None) -> None:
    with pytest.raises(ComponentError, match=f"FMU 'tank' gave no answer for 1 s {AT_HALF}: misfit stopped it"):
        _run(tmp_path, "hang", HASTY)


@pytest.mark.parametrize("fault", ["open_file", "chatter"])
def test_open_files_and_much_output_stay_with_the_child(fault: str, tmp_path: Path, handles: None) -> None:
    assert _run(tmp_path, fault) == pytest.approx(1.0, abs=1e-12)


def test_an_error_that_the_fmu_reports_keeps_its_words(tmp_path: Path, handles: None) -> None:
    with pytest.raises(ComponentError, match=r"t = 0.5 s.*status Error.*the tank at 3 percent is empty"):
        _run(tmp_path, "error")
