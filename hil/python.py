"""Sessions at the bench from Python: the same session, safety core and recording as `misfit hil hold`."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError


@dataclass(frozen=True)
class BenchSession:
    """A session that is over: `document` is what `misfit hil hold --json` says, `folder` its recording."""

    document: dict[str, Any]
    folder: Path

    @property
    def faults(self) -> tuple[str, ...]:
        """What stopped the session, if anything did."""
        return tuple(self.document["faults"])

    def replay(self) -> bool:
        """Run the recording through the same decisions; whether every frame comes out again, bit for bit."""
        from hil.session.recorded import replay_session

        return replay_session(self.folder).first_different is None

    def _repr_html_(self) -> str:
        from html import escape

        rows = "".join(f"<tr><td>{escape(k)}</td><td>{escape(str(v))}</td></tr>" for k, v in self.document.items())
        return f"<table>{rows}</table>"


@dataclass(frozen=True)
class Bench:
    """A bench with a robot on CAN: a virtual one, or that of a file with bus, robot and limits.

    Args:
        file: settings of a real bench (TOML); a virtual robot without it.
        rate_hz: cycles a second.
    """

    file: "str | Path | None" = None
    rate_hz: float = 500.0

    def hold(
        self,
        seconds: float,
        folder: "str | Path",
        *,
        dry_run: bool = False,
        at_home: Callable[[], bool] | None = None,
        may_arm: Callable[[Any], bool] | None = None,
    ) -> BenchSession:
        """Hold the arm where it is, and record everything.

        Args:
            seconds: how long, once the arm is armed.
            folder: where to record; a new or empty folder.
            dry_run: decide and record everything, send no torque.
            at_home, may_arm: asked before a real arm is zeroed and armed; on a terminal the operator is asked without them.

        Raises:
            MisfitError: if the bus, the robot or the settings do not fit.
            ComponentError: if the bus breaks or records are lost.
        """
        from hil.session.entry import Operator
        from hil.session.session import run_session
        from hil.terminal import ask_arm, ask_home, robot_of

        if not seconds > 0.0:
            raise MisfitError(f"hold({seconds}): expected a time above 0 s")
        with ExitStack() as stack:
            bench = None if self.file is None else Path(self.file)
            settings = robot_of(bench is None, bench, self.rate_hz, stack)
            home, arm = (_yes, _yes) if bench is None else (at_home or ask_home, may_arm or ask_arm)
            target = Path(folder)
            document = run_session(settings, seconds, Operator(home, arm), target, dry_run=dry_run)
        return BenchSession(document, target)


def _yes(*about: Any) -> bool:
    return True
