"""Which trials, or which parts of a record, are learned from and which are held out; and what case.toml says of it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fmus.errors import MisfitError
from orchestrator.measurements.toml_values import TomlTable
from orchestrator.measurements.trial import Record, Subset, Trial
from orchestrator.measurements.wording import shown


class Split(Protocol):
    """A rule that turns records into learning and held-out trials."""

    def trials(self, records: Sequence[Record]) -> tuple[Trial, ...]:
        """Cut or label the records; raises MisfitError where the rule does not fit them."""
        ...

    def notes(self, records: Sequence[Record]) -> tuple[str, ...]:
        """Say what was decided without being asked for."""
        ...


@dataclass(frozen=True)
class ByNumber:
    """Whole files, by their position in `files`, counted from 1; the two never share a number."""

    learning: tuple[int, ...]
    held_out: tuple[int, ...]

    def trials(self, records: Sequence[Record]) -> tuple[Trial, ...]:
        """Label the named records, in the order of the files; the others are left out."""
        chosen: list[Trial] = []
        for number, record in enumerate(records, 1):
            if number in self.learning:
                chosen.append(record.trial("learning"))
            elif number in self.held_out:
                chosen.append(record.trial("held_out"))
        return tuple(chosen)

    def notes(self, records: Sequence[Record]) -> tuple[str, ...]:
        """Name the files that neither list holds, and say if nothing is held out."""
        used = {*self.learning, *self.held_out}
        notes = [
            f"{record.name} is neither a learning nor a held-out trial and is not used"
            for number, record in enumerate(records, 1)
            if number not in used
        ]
        if not self.held_out:
            notes.append("no trial is held out, so no score on unseen data is possible")
        return tuple(notes)


@dataclass(frozen=True)
class ByWindow:
    """Two windows `start <= time < stop`, in s, of one long record."""

    learning: tuple[float, float]
    held_out: tuple[float, float]

    def trials(self, records: Sequence[Record]) -> tuple[Trial, ...]:
        """Cut the record into two trials.

        Raises:
            MisfitError: a window holds fewer than two samples.
        """
        (record,) = records
        return (_window(record, "learning", *self.learning), _window(record, "held_out", *self.held_out))

    def notes(self, records: Sequence[Record]) -> tuple[str, ...]:
        """Nothing was assumed: both windows were given."""
        return ()


@dataclass(frozen=True)
class LastThird:
    """Nobody said: hold out the last third of the files (rounded up), or of the only record's time."""

    def trials(self, records: Sequence[Record]) -> tuple[Trial, ...]:
        """Label the records, or cut the only one two thirds of the way through its time."""
        if len(records) > 1:
            return self._by_number(records).trials(records)
        (record,) = records
        start, stop = float(record.time[0]), float(record.time[-1])
        late = record.time >= start + (stop - start) * 2 / 3
        # A record of a few samples has no third that could be simulated.
        if np.sum(~late) < 2 or np.sum(late) < 2:
            return (record.trial("learning"),)
        cut = float(record.time[late][0])
        return (record.window("learning", start, cut, ~late), record.window("held_out", cut, stop, late))

    def notes(self, records: Sequence[Record]) -> tuple[str, ...]:
        """Say what was held out."""
        held_out = [t.name for t in self.trials(records) if t.subset == "held_out"]
        if not held_out:
            return (
                f"{records[0].name} has too few samples to hold a third of it out, so no score on unseen data is possible",
            )
        part = "the last third of the trials" if len(records) > 1 else "the last third of the record"
        return (f"no split was given: {part} is held out ({', '.join(held_out)}), the rest is for learning",)

    @staticmethod
    def _by_number(records: Sequence[Record]) -> ByNumber:
        first_held_out = len(records) - math.ceil(len(records) / 3) + 1
        numbers = range(1, len(records) + 1)
        return ByNumber(
            tuple(n for n in numbers if n < first_held_out), tuple(n for n in numbers if n >= first_held_out)
        )


def _window(record: Record, subset: Subset, start: float, stop: float) -> Trial:
    rows = (record.time >= start) & (record.time < stop)
    if np.sum(rows) < 2:
        raise MisfitError(
            f"{record.name}: {subset}_window_s = [{start:g}, {stop:g}] s holds {np.sum(rows)} samples of a record from {record.time[0]:g} s to {record.time[-1]:g} s; move the window into the record"
        )
    return record.window(subset, start, stop, rows)


def read_split(table: TomlTable, files: Sequence[str]) -> Split:
    """Read the split that a case.toml asks for; without any, the last third is held out.

    Of `learning` and `held_out` one may be absent: it is then the rest of the `files`.

    Raises:
        MisfitError: a number or window does not fit the files, or learning and held-out data overlap.
    """
    windows = (table.get_window("learning_window_s"), table.get_window("held_out_window_s"))
    numbers = table.get_positions("learning", files), table.get_positions("held_out", files)
    n_files = len(files)
    if windows == (None, None):
        return LastThird() if numbers == (None, None) else _by_number(table, numbers, n_files)
    if numbers != (None, None):
        raise MisfitError(
            f"{table.where}: both trial numbers (learning, held_out) and windows (learning_window_s, held_out_window_s); keep one of the two"
        )
    return _by_window(table, windows, n_files)


def _by_number(
    table: TomlTable, numbers: tuple[tuple[int, ...] | None, tuple[int, ...] | None], n_files: int
) -> ByNumber:
    for key, chosen in zip(("learning", "held_out"), numbers, strict=True):
        for n in chosen or ():
            if not 1 <= n <= n_files:
                raise MisfitError(
                    f"{table.where}: {key} names trial {shown(n)}, but there are {n_files} files (trials 1 to {n_files}); correct the number or add the file"
                )
    everything = range(1, n_files + 1)
    learning, held_out = numbers
    if learning is None:
        learning = tuple(n for n in everything if n not in (held_out or ()))
    if held_out is None:
        held_out = tuple(n for n in everything if n not in learning)
    shared = sorted(set(learning) & set(held_out))
    if shared:
        raise MisfitError(
            f"{table.where}: trial {shared[0]} is in learning and in held_out; a held-out trial must not be learned from; remove it from one list"
        )
    if not learning:
        raise MisfitError(f"{table.where}: no trial is left for learning; put at least one number into learning")
    return ByNumber(learning, held_out)


def _by_window(
    table: TomlTable, windows: tuple[tuple[float, float] | None, tuple[float, float] | None], n_files: int
) -> ByWindow:
    learning, held_out = windows
    if learning is None or held_out is None:
        raise MisfitError(f"{table.where}: learning_window_s and held_out_window_s belong together; give both")
    if n_files != 1:
        raise MisfitError(
            f"{table.where}: windows cut one long record, but there are {n_files} files; use learning = [...] and held_out = [...]"
        )
    if learning[0] < held_out[1] and held_out[0] < learning[1]:
        raise MisfitError(
            f"{table.where}: learning_window_s = {list(learning)} s and held_out_window_s = {list(held_out)} s overlap; held-out data must not be learned from; move one window"
        )
    return ByWindow(learning, held_out)
