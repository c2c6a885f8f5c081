"""The virtual robot as a process: `python -m hil.virtual [--port N] [--side S] [--pendant P]`; says its port on the
first line."""

import argparse
import os
import signal
import sys
from collections.abc import Callable, Mapping
from contextlib import closing

from fmus.children import parent_process
from fmus.errors import MisfitError
from hil.bus.wire import open_wire
from hil.control.timing import real_time_priority
from hil.robots.known import PROFICIO
from hil.virtual.adapters import BusServer, SerialAdapter
from hil.virtual.beside import Ears
from hil.virtual.body import Body
from hil.virtual.made import KINDS, Made
from hil.virtual.socketcand import SocketcandServer

# Below that of a session's loop.
PRIORITY = 70


def serve(port: int, made: Made) -> None:
    """Serve until told to stop, or until the process that began it is gone; prints the port first.

    Raises:
        MisfitError: if there is no such model of an arm.
    """
    server = SocketcandServer(made.made(), port)
    _run(server.serve, lambda: print(server.port, flush=True))


def serve_on(settings: Mapping[str, object], port: int, made: Made) -> None:
    """Serve on a bus of python-can until told to stop; hears words at a port beside it.

    Raises:
        MisfitError: if there is no such bus, no such model of an arm, or the port is taken.
    """
    with closing(Ears(port)) as ears, closing(open_wire(settings, frozenset())) as wire:
        _run(BusServer(made.made(), wire.bus, ears=ears).serve, lambda: _say_ears(ears))


def serve_slcan(port: int, made: Made) -> None:
    """Serve behind a serial adapter on a pseudo-terminal until told to stop; prints its path first, hears words at a port.

    Raises:
        MisfitError: if there is no such model of an arm, or the port is taken.
    """
    with closing(Ears(port)) as ears, SerialAdapter() as adapter:

        def say() -> None:
            print(adapter.path, flush=True)
            _say_ears(ears)

        _run(BusServer(made.made(), adapter, ears=ears).serve, say)


def _say_ears(ears: Ears) -> None:
    print(f"hears `misfit hil tell` at port {ears.port}", file=sys.stderr, flush=True)


def _run(serve: Callable[[Callable[[], bool]], None], say: Callable[[], None]) -> None:
    """Serve with priority until a signal comes, or the process that began this one is gone.

    Where it is to be found is said once signals are heard: whoever reads that may stop it at once.
    """
    parent, ended = parent_process(), list[int]()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda number, frame: ended.append(number))
    say()
    with real_time_priority(PRIORITY):
        serve(lambda: bool(ended) or os.getppid() != parent)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description="A virtual robot on a socketcand server at 127.0.0.1")
    parser.add_argument("--port", type=int, default=0, help="TCP port; 0 takes a free one")
    parser.add_argument("--side", choices=["left", "right"], default="right")
    parser.add_argument("--kind", choices=KINDS, default=PROFICIO)
    parser.add_argument("--pendant", choices=["idle", "active"], default="active", help="pressed once it is zeroed")
    parser.add_argument("--body", type=Body.from_json, help="the arm on it, as JSON: model, values, shoulder")
    args = parser.parse_args()
    try:
        serve(args.port, Made(args.side, args.pendant == "active", args.body, kind=args.kind))
    except MisfitError as error:  # for whoever began it to say
        sys.exit(str(error))


if __name__ == "__main__":
    main()
