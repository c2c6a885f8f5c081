"""Bad calls are answered by an error status and a message; nothing crashes, in any order of calls."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from helpers_relations import relay
from helpers_systems import lag

from fmus.archive import extract_fmu
from fmus.package import build_fmu

SYSTEMS = {"lag": lag, "relay": relay}  # a delay and parameters, a relation and an event indicator
KINDS = [(name, version) for name in SYSTEMS for version in ("2.0", "3.0")]


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], Path]:
    root = tmp_path_factory.mktemp("fmus")
    made = {}
    for name, version in KINDS:
        fmu = build_fmu(SYSTEMS[name](), root / f"{name}{version}.fmu", fmi_version=version)
        made[name, version] = extract_fmu(fmu, root / f"{name}{version}")
    return made


def findings(folder: Path, mode: str, seeds: int = 0) -> list[str]:
    script = Path(__file__).with_name("calls.py")
    done = subprocess.run(
        [sys.executable, str(script), str(folder), mode, str(seeds)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, f"exit {done.returncode}: {done.stderr[-2000:]}"
    found: list[str] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_a_call_in_a_wrong_phase_is_refused_with_a_message(
    folders: dict[tuple[str, str], Path], kind: tuple[str, str]
) -> None:
    assert findings(folders[kind], "phases") == []


@pytest.mark.parametrize("kind", KINDS)
def test_a_wrong_argument_is_refused_with_a_message(
    folders: dict[tuple[str, str], Path], kind: tuple[str, str]
) -> None:
    assert findings(folders[kind], "arguments") == []


@pytest.mark.parametrize("kind", KINDS)
def test_no_order_of_calls_crashes(folders: dict[tuple[str, str], Path], kind: tuple[str, str]) -> None:
    assert findings(folders[kind], "random", 300) == []
