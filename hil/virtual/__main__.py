"""The virtual robot as a process: `python -m hil.virtual [--port N] [--side S] [--pendant P]`; says its port on the first line."""

import argparse
import os
import signal

from hil.robots import proficio
from hil.robots.proficio import Side
from hil.session.timing import real_time_priority
from hil.virtual.plant import FreeJoints
from hil.virtual.robot import VirtualRobot
from hil.virtual.socketcand import SocketcandServer

# Below that of a session's loop.
PRIORITY = 70


def serve(port: int, side: Side, eager: bool) -> None:
    """Serve until told to stop, or until the process that began it is gone; prints the port first."""
    robot = VirtualRobot(FreeJoints(proficio.HOME[side]), eager=eager)
    server, parent = SocketcandServer(robot, port), os.getppid()
    ended: list[int] = []
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda number, frame: ended.append(number))
    print(server.port, flush=True)
    with real_time_priority(PRIORITY):
        server.serve(lambda: bool(ended) or os.getppid() != parent)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description="A virtual Proficio on a socketcand server at 127.0.0.1")
    parser.add_argument("--port", type=int, default=0, help="TCP port; 0 takes a free one")
    parser.add_argument("--side", choices=["left", "right"], default="right")
    parser.add_argument("--pendant", choices=["idle", "active"], default="active", help="pressed once it is zeroed")
    args = parser.parse_args()
    serve(args.port, args.side, args.pendant == "active")


if __name__ == "__main__":
    main()
