"""What tests of several folders share."""

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

# Tests change and replace parts of the Python core; what was compiled on this machine is tested in
# tests/hil/test_compiled_decision.py.
os.environ["MISFIT_PURE"] = "1"

from tests.chromium import FLAGS, children_killed_after, program
from tests.slow import is_slow, turn

if TYPE_CHECKING:
    from playwright.sync_api import Browser

CLOSING_S = 30.0

# A busy machine is no finding.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what the list of slow tests names, and let the files that take longest begin first."""
    items.sort(key=lambda item: turn(item.nodeid))
    for item in items:
        if is_slow(item.nodeid):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def browser() -> "Iterator[Browser]":
    """A headless Chromium, one for all: Playwright cannot be started twice in a process.

    Without one the tests are skipped; `MISFIT_BROWSER=required` makes its absence an error.
    """
    found = program()
    if found is None:
        required = os.environ.get("MISFIT_BROWSER") == "required"
        (pytest.fail if required else pytest.skip)("no Chromium on this machine: install the package 'chromium'")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=found, args=FLAGS)
        yield chromium
        with children_killed_after(CLOSING_S):
            chromium.close()
            playwright.stop()
