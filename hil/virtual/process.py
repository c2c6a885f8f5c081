"""A virtual robot beside a session, in a process of its own."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

from fmus.children import child_environment, python_command
from fmus.errors import ComponentError
from hil.processes import NOT_NEEDED
from hil.robots.known import PROFICIO
from hil.robots.proficio import Side
from hil.virtual.body import Body


@contextmanager
def virtual_robot(side: Side = "right", body: Body | None = None, kind: str = PROFICIO) -> Iterator[dict[str, object]]:
    """Run one, with an arm on it or without; yields what python-can needs to reach it.

    Args:
        side: of the arm.
        body: the arm that lies on it.
        kind: name of the robot's kind.

    Raises:
        ComponentError: if it does not come up.
    """
    command = python_command("hil.virtual", "--side", side, "--kind", kind)
    if body is not None:
        command += ["--body", body.to_json()]
    process = subprocess.Popen(
        command,
        env=child_environment(MISFIT_WITHOUT=NOT_NEEDED),
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline().strip()
        if not line.isdigit():
            raise ComponentError("the virtual robot did not come up; run `misfit hil robot` to see why")
        yield {"interface": "socketcand", "host": "127.0.0.1", "port": int(line), "channel": "can0"}
    finally:
        process.terminate()
        process.communicate(timeout=10)
