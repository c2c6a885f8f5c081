"""A browser that does not end holds up no test run: a run in continuous integration had waited for one until it was ended itself.

In a process of its own, since all children of this one would be killed, other tests' browser among them.
"""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROGRAM = """
import subprocess, sys
from tests.chromium import children_killed_after
child = subprocess.Popen([sys.executable, "-c", sys.argv[1]])
with children_killed_after(float(sys.argv[2])):
    print(child.wait())
"""


def code_of(child: str, seconds: float) -> int:
    """Exit code of a child that may run so many seconds."""
    command = [sys.executable, "-c", PROGRAM, child, str(seconds)]
    return int(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True, timeout=30).stdout)


def test_a_child_that_does_not_end_is_killed_when_its_time_is_over() -> None:
    assert code_of("import time; time.sleep(60)", 0.2) == -9


def test_a_child_that_ends_in_time_is_left_alone() -> None:
    assert code_of("pass", 60.0) == 0
