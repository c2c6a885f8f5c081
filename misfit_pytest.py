"""The pytest plugin: cases are collected, and two fixtures run and compare models.

It is active in every run of pytest where misfit is installed. Our packages are imported when the first case file, FMU or fixture is
asked for, from their own folder: a project with a module `orchestrator` of its own and without cases sees nothing of them.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from misfit_start import import_our_packages

if TYPE_CHECKING:
    from orchestrator.regress import plugin

_PLUGIN = "orchestrator.regress.plugin"


def _plugin() -> "plugin":  # type: ignore[valid-type]
    import_our_packages()
    from orchestrator.regress import plugin

    return plugin


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Case files, and FMUs that bring their own results and that no case file beside them names."""
    if file_path.name.endswith("regress.toml") or file_path.suffix == ".fmu":
        return _plugin().collected(file_path, parent)
    return None


def pytest_unconfigure(config: pytest.Config) -> None:
    """End the processes."""
    if _PLUGIN in sys.modules:
        _plugin().end_processes(config)


@pytest.fixture
def misfit_run(request: pytest.FixtureRequest) -> Callable[..., Any]:
    """Run a model in a process of its own: `misfit_run("ball.fmu", stop=2.0, step=0.01)` gives its signals by name.

    The model is relative to the test's file. Keywords are those of `Case` (stop, step, start, interface, ...),
    `parameters` (values by variable), `inputs` (numbers or generators by input) and `signals` (names; all outputs without).
    A component that fails raises ComponentError, a model that cannot be run MisfitError.
    """
    return _plugin().runner(request)


@pytest.fixture
def misfit_compare() -> Callable[..., Any]:
    """Compare signals by name with others or with a file; fails the test with a line for each signal that differs.

    `misfit_compare(result, "ball_ref.csv", absolute=1e-3)`: keywords are those of `Tolerance`. `signals` names those that
    count, all of the reference without.
    """
    return _plugin().compared_or_failed
