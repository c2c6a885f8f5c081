"""What an FMU's default experiment says of the tolerance holds where nobody else says anything, as in other importers."""

import re
import zipfile
from pathlib import Path
from typing import Any

import pytest
from small_fmus import small_fmu

from orchestrator.cosim import ComponentSpec, RunSettings, Simulation, System
from orchestrator.cosim.container import container_of
from orchestrator.cosim.fmu.instance2 import Instance2


def told(source: Path, monkeypatch: pytest.MonkeyPatch, tolerance: float | None) -> float | None:
    """The tolerance that the FMU is told."""
    seen: list[float | None] = []
    begin = Instance2._begin

    def watched(self: Instance2, time: float, stop: float | None, tolerance: float | None) -> Any:
        seen.append(tolerance)
        return begin(self, time, stop, tolerance)

    monkeypatch.setattr(Instance2, "_begin", watched)
    spec = ComponentSpec("fmu", source=str(source), options={"interface": "CoSimulation"})
    run = RunSettings(step=0.1, tolerance=tolerance)
    with Simulation(System("one", {"fmu": spec}, run=run, folder=Path("/"))) as simulation:
        simulation.run(0.2)
    return seen[0]


@pytest.fixture
def strict(tmp_path: Path) -> Path:
    """An FMU with a default tolerance of 1e-7."""
    target = tmp_path / "strict.fmu"
    with zipfile.ZipFile(small_fmu("decay")) as source, zipfile.ZipFile(target, "w") as archive:
        for entry in source.infolist():
            content = source.read(entry)
            if entry.filename == "modelDescription.xml":
                text = re.sub(r"<DefaultExperiment[^>]*/>", "", content.decode())
                content = text.replace(
                    "<ModelVariables>", '<DefaultExperiment tolerance="1e-7"/><ModelVariables>'
                ).encode()
            archive.writestr(entry, content)
    return target


def test_its_own_tolerance_counts_unless_the_system_gives_one(strict: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert told(strict, monkeypatch, None) == 1e-7
    assert told(strict, monkeypatch, 1e-4) == 1e-4
    assert told(small_fmu("decay"), monkeypatch, None) is None


def test_so_it_does_inside_one_fmu(strict: Path, tmp_path: Path) -> None:
    spec = ComponentSpec("fmu", source=str(strict), options={"interface": "CoSimulation"})
    files, _ = container_of(System("one", {"fmu": spec}, run=RunSettings(step=0.1), folder=Path("/")), "one", tmp_path)

    with zipfile.ZipFile(files[0]) as archive:
        assert ".tolerance = 1e-07" in archive.read("sources/system.c").decode()
