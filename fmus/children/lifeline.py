"""A pipe between a process and its child: it closes when the process ends, however that happens, and so ends the child."""

import os
import signal
import sys
import threading

# `F_SETSIG` of Linux (`fcntl.h`): the signal that tells the owner of a file that something happened there.
_F_SETSIG = 10


def kill_when_closed(reading: int, group: int) -> None:
    """Let the kernel kill a process group when the other end of its pipe is closed, whatever the group is doing then.

    Only Linux can; elsewhere a child that runs Python watches the pipe itself, see `end_with`.

    Args:
        reading: the end that the group inherited; this process may close it afterwards.
        group: number of the process group.
    """
    if sys.platform != "linux":
        return
    import fcntl

    try:
        fcntl.fcntl(reading, fcntl.F_SETOWN, -group)
    except ProcessLookupError:  # it has ended already
        return
    fcntl.fcntl(reading, _F_SETSIG, signal.SIGKILL)
    fcntl.fcntl(reading, fcntl.F_SETFL, fcntl.fcntl(reading, fcntl.F_GETFL) | os.O_ASYNC)


def end_with(reading: int) -> None:
    """End this process when the other end of the pipe is closed."""
    threading.Thread(target=_wait, args=(reading,), daemon=True, name="lifeline").start()


def _wait(reading: int) -> None:
    os.read(reading, 1)
    os._exit(1)
