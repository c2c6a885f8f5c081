"""A session as the bench view knows it: what it shows now, how it was lately, and what has become of it."""

import json
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from enum import Enum
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from hil.bench_view.residual_map import ResidualMap
from hil.emulation.planar import Placement
from hil.processes import lives, process_of
from hil.stop.flag import StopFlag
from hil.view.glance import Glance, Look
from hil.view.window import PREFIX, windows

PAUSE_S = 0.05
# New sessions are looked for once in so many looks at the known ones.
FIND_EVERY = 10
# A session without a new cycle for so long is stuck; its watchdog has let the arm go long before.
STUCK_S = 0.5
# So much of the past is kept for curves.
PAST_S = 20.0
# A stop button's server that has been silent for so long is dead.
SILENT_S = 0.6
# Sessions that have ended are remembered, so many of them.
REMEMBERED = 4


class Life(Enum):
    """What has become of a session."""

    WAITING = "waiting"
    RUNNING = "running"
    STUCK = "stuck"
    WRITING = "writing"
    ENDED = "ended"
    KILLED = "killed"


@dataclass(frozen=True)
class Past:
    """One moment: time in s since the first cycle, residual and what was learned (2,) in N.m, how sure that is."""

    time_s: float
    residual: np.ndarray
    learned: np.ndarray
    unsure: float


@dataclass
class Watched:
    """One session; `refresh` is called by the thread of `Sessions`, everything else only reads."""

    look: Look
    about: dict[str, Any]
    glance: Glance | None = None
    life: Life = Life.WAITING
    map: ResidualMap | None = None
    past: deque[Past] = field(default_factory=lambda: deque(maxlen=round(PAST_S / PAUSE_S)))
    stop: StopFlag | None = None
    _seen_s: float = field(default_factory=time.monotonic)
    _lately: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=round(1.0 / PAUSE_S)))

    @staticmethod
    def open(path: Path) -> "Watched":
        """Begin to watch.

        Raises:
            MisfitError: if it has ended.
        """
        look = Look(path)
        found = Watched(look, dict(look.about))
        arm = found.about.get("arm")
        if arm is not None and "residual1" in found.about["signals"]:
            found.map = ResidualMap(np.array(arm["low"]), np.array(arm["high"]))
        try:
            found.stop = StopFlag(Path(found.about["stop"]), read_only=True)
        except (KeyError, MisfitError):
            found.stop = None
        return found

    @property
    def lately(self) -> tuple[Past, ...]:
        """The last moments, the newest last; a copy, as the thread that looks goes on."""
        return tuple(self.past)

    @property
    def name(self) -> str:
        """What it is called in the page's address; no other session, also of the same process, has this name."""
        return self.look.path.name.removeprefix(PREFIX)

    @property
    def title(self) -> str:
        """Which session and robot it is."""
        return str(self.about.get("name", f"session {process_of(self.look.path, PREFIX)}"))

    @property
    def folder(self) -> Path | None:
        """Where it records."""
        recording = self.about.get("recording")
        return Path(recording) if recording else None

    @property
    def is_over(self) -> bool:
        """Whether no cycle will come any more."""
        return self.life in (Life.WRITING, Life.ENDED, Life.KILLED)

    @property
    def silent_s(self) -> float:
        """How long ago its newest cycle was seen, in s, by this machine's clock; 0 before the first cycle."""
        return time.monotonic() - self._seen_s if self.glance is not None else 0.0

    @property
    def stop_is_dead(self) -> bool:
        """Whether its stop button is not to be relied on."""
        return not self.is_over and (self.stop is None or self.stop.silent_s > SILENT_S)

    @property
    def rate_hz(self) -> float | None:
        """Cycles a second: of the last second, of all once it is over; None before there are two."""
        if self.glance is None or not self._lately:
            return None
        cycles, since_s = (1, self.glance.began_ns * 1e-9) if self.is_over else self._lately[0]
        passed_s = self.glance.time_ns * 1e-9 - since_s
        return (self.glance.cycles - cycles) / passed_s if passed_s > 0 else None

    @property
    def arm_angles(self) -> np.ndarray | None:
        """Where the emulated arm is, (2,) in rad; None without one."""
        if self.glance is None or "arm" not in self.about:
            return None
        return Placement(self.about["side"], self.about["arm"]["shoulder"]).angles(np.array(self.glance.angles))

    def signal(self, name: str) -> float | None:
        """A signal of its controller; None if it has none of that name."""
        names = self.about.get("signals", [])
        return self.glance.shown[names.index(name)] if self.glance is not None and name in names else None

    def pair(self, name: str) -> np.ndarray | None:
        """A signal that there is for both joints of the arm, (2,)."""
        values = [self.signal(f"{name}{k}") for k in (1, 2)]
        return None if None in values else np.array(values)

    def result(self) -> dict[str, Any] | None:
        """What the session says of itself at its end; None if it has not said it."""
        try:
            found = json.loads((self.folder / "summary.json").read_text()) if self.folder is not None else None
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) else None

    def refresh(self) -> None:
        """Look again."""
        if self.life in (Life.ENDED, Life.KILLED):
            return
        glance = self.look.look()
        if glance is not None and (self.glance is None or glance.cycles != self.glance.cycles):
            self.glance, self._seen_s = glance, time.monotonic()
            self._lately.append((glance.cycles, glance.time_ns * 1e-9))
            self._remember(glance)
        self.life = self._life()

    def _life(self) -> Life:
        alive = lives(process_of(self.look.path, PREFIX))
        if not alive:
            ended = self.folder is None or self.result() is not None
            return Life.ENDED if ended else Life.KILLED
        if not self.look.path.exists():
            return Life.WRITING
        if self.glance is None:
            return Life.WAITING
        return Life.STUCK if self.silent_s > STUCK_S else Life.RUNNING

    def _remember(self, glance: Glance) -> None:
        residual, learned, angles = self.pair("residual"), self.pair("learned"), self.arm_angles
        if self.map is None or residual is None or learned is None or angles is None:
            return
        # Before the controller has been asked for the first time, as in the proof of the arm, all its signals are zero.
        if glance.stage == 0 or not (unsure := self.signal("unsure")):
            return
        time_s = (glance.time_ns - glance.began_ns) * 1e-9
        self.map.add(time_s, angles, residual)
        self.past.append(Past(time_s, residual, learned, unsure))


class Sessions:
    """All sessions on this machine, looked at 20 times a second from a thread of its own."""

    def __init__(self) -> None:
        self._found: dict[Path, Watched] = {}
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def begin(self) -> None:
        """Look from now on; does nothing if it does already."""
        with self._lock:
            if self._thread is None or not self._thread.is_alive():
                self._thread = threading.Thread(target=self._run, daemon=True, name="bench view")
                self._thread.start()

    def all(self) -> list[Watched]:
        """Those that are known, the newest first."""
        with self._lock:
            return list(reversed(self._found.values()))

    def chosen(self, name: str | None) -> Watched | None:
        """The session of that name; without one the newest that runs, or else the newest."""
        found = self.all()
        if name is not None:
            return next((each for each in found if each.name == name), None)
        return next((each for each in found if not each.is_over), found[0] if found else None)

    def find(self) -> None:
        """Look for new sessions, and forget those that have ended long ago."""
        for path in windows():
            if path not in self._found:
                try:
                    watched = Watched.open(path)
                except (MisfitError, ValueError):  # it ended meanwhile, or is of another version
                    continue
                watched.refresh()
                with self._lock:
                    self._found[path] = watched
        with self._lock:
            over = [path for path, each in self._found.items() if each.is_over]
            for path in over[:-REMEMBERED]:
                del self._found[path]

    def look(self) -> None:
        """Look at all that are known."""
        for each in self.all():
            each.refresh()

    def _run(self) -> None:
        for turn in count():
            if turn % FIND_EVERY == 0:
                self.find()
            self.look()
            time.sleep(PAUSE_S)
