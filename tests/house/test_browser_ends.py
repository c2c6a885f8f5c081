"""A browser that does not end holds up no test run: a run in continuous integration had waited for one until it was ended itself."""

import subprocess
import sys
import time

from tests.chromium import children_killed_after


def test_a_child_that_does_not_end_is_killed_when_its_time_is_over() -> None:
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    begun = time.monotonic()
    with children_killed_after(0.2):
        assert child.wait() == -9
    assert time.monotonic() - begun < 30


def test_a_child_that_ends_in_time_is_left_alone() -> None:
    child = subprocess.Popen([sys.executable, "-c", "pass"])
    with children_killed_after(60.0):
        assert child.wait() == 0
