"""A look through a session's window, from any process of the same user; it cannot write."""

import json
import mmap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from hil.view import layout

_TRIES = 100


@dataclass(frozen=True)
class Broken:
    """A rule that was broken while the arm was armed: first and last time (ns), cycles, worst reaction, words."""

    rule: str
    first_ns: float
    last_ns: float
    cycles: int
    reaction: int
    words: str


@dataclass(frozen=True)
class Glance:
    """One look: times in ns, vectors by joint (force: x, y, z), cycles by class of lateness, the rules that were broken.

    `reason` is why the arm is stopped, or, before it is armed, why it cannot be; `shown` are the controller's own signals.
    """

    period_ns: float
    began_ns: float
    latest_us: float
    time_ns: float
    cycles: int
    missing: int
    missed: int
    reaction: int
    stage: int
    angles: tuple[float, ...]
    speeds: tuple[float, ...]
    torques: tuple[float, ...]
    asked: tuple[float, ...]
    force: tuple[float, ...]
    shown: tuple[float, ...]
    lateness: tuple[int, ...]
    broken: tuple[Broken, ...]
    reason: str

    def late_us(self, share: float) -> float:
        """Lateness in us that this share of the cycles does not exceed: the upper end of its class, at most the latest."""
        left = share * sum(self.lateness)
        for edge, count in zip(layout.EDGES, self.lateness, strict=False):
            left -= count
            if left <= 0:
                return min(edge, self.latest_us)
        return self.latest_us


class Look:
    """An open window."""

    def __init__(self, path: Path) -> None:
        """Open it for reading.

        Raises:
            MisfitError: if it is none.
        """
        self.path = path
        try:
            with path.open("rb") as file:
                self._memory = mmap.mmap(file.fileno(), layout.SIZE, access=mmap.ACCESS_READ)
        except (OSError, ValueError) as error:
            raise MisfitError(f"{path} shows no session: {error}; it may have ended") from error
        self._numbers = memoryview(self._memory)[: layout.PLACES * 8].cast("d")

    @cached_property
    def about(self) -> Mapping[str, Any]:
        """What never changes while the session lasts."""
        text = self._text(self._memory[layout.ABOUT_AT :])
        found: Mapping[str, Any] = json.loads(text) if text else {}
        return found

    def look(self) -> Glance | None:
        """The last cycle; None before the first one, or if the writer never lets one look."""
        for _ in range(_TRIES):
            after = self._numbers[layout.DONE]
            values = self._numbers.tolist()
            texts = bytes(self._memory[layout.WORDS_AT : layout.ABOUT_AT])
            if after and self._numbers[layout.BEGUN] == after:
                return self._glance(values, texts)
        return None

    def _glance(self, values: Sequence[float], texts: bytes) -> Glance:
        start = layout.HEAD + len(layout.NOW)
        time_ns, *counts = values[layout.HEAD : start]
        cycles, missing, missed, reaction, stage = map(int, counts)
        places = range(start, layout.SHOWN, layout.JOINTS)
        angles, speeds, torques, asked, force = (tuple(values[k : k + layout.JOINTS]) for k in places)
        return Glance(
            values[layout.PERIOD],
            values[layout.BEGAN],
            values[layout.LATEST],
            time_ns,
            cycles,
            missing,
            missed,
            reaction,
            stage,
            angles,
            speeds,
            torques,
            asked,
            force,
            tuple(values[layout.SHOWN : layout.CLASSES]),
            tuple(int(count) for count in values[layout.CLASSES : layout.TRIPS]),
            tuple(self._broken(values, texts)),
            self._text(texts[-layout.REASON :]),
        )

    def _broken(self, values: Sequence[float], texts: bytes) -> list[Broken]:
        found = []
        for k, rule in enumerate(layout.RULE_NAMES):
            at = layout.TRIPS + k * layout.PER_TRIP
            first, last, cycles, reaction = values[at : at + layout.PER_TRIP]
            if cycles:
                words = self._text(texts[k * layout.WORDS : (k + 1) * layout.WORDS])
                found.append(Broken(rule, first, last, int(cycles), int(reaction), words))
        return sorted(found, key=lambda broken: broken.first_ns)

    def _text(self, data: bytes) -> str:
        return data.rstrip(b"\0").decode("utf-8", "replace")

    def close(self) -> None:
        """Give the memory back; the file stays for others."""
        self._numbers.release()
        self._memory.close()
