"""A protocol: which trials a session runs, in a TOML file."""

import json
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from fmus.errors import MisfitError
from hil.emulation.settings import JOINTS, MUSCLES

_TRIAL_KEYS = ("posture", "activations")
_STUDY_KEYS = ("postures", "repeats", "seed", "most")
_LONGEST_S = 600.0


@dataclass(frozen=True)
class Trial:
    """One trial: `posture` (2,) rad of the emulated arm, `activations` (6,) between 0 and 1."""

    posture: tuple[float, ...]
    activations: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse what no arm can do."""
        if len(self.posture) != JOINTS or not np.all(np.isfinite(self.posture)):
            raise MisfitError(f"posture = {list(self.posture)}; angles of shoulder and elbow in rad were expected")
        if len(self.activations) != MUSCLES or not all(0.0 <= a <= 1.0 for a in self.activations):
            raise MisfitError(f"activations = {list(self.activations)}; six numbers between 0 and 1 were expected")


@dataclass(frozen=True)
class Protocol:
    """Trials in their order, and how long each part of one takes.

    Args:
        rest: (2,) rad, the posture before the first and after each trial.
        move_speed: rad/s that no joint passes on its way.
        settle_s: time to stand still before a trial is announced.
        announce_s: least time between the announcement and the stimulation.
        stimulate_s: time with activations, of which `rise_s` s each for them to come and go.
        confirm: whether somebody has to confirm each trial.
        held_out: share of the trials, the last ones, that a measurement set keeps for the final score.
        strength: share (6,) of its nominal force that each emulated muscle has; below 1 a weak one, of which the
            recording does not tell.
    """

    trials: tuple[Trial, ...]
    rest: tuple[float, ...] = (0.75, 1.35)
    move_speed: float = 0.5
    settle_s: float = 0.5
    announce_s: float = 1.0
    stimulate_s: float = 2.0
    rise_s: float = 0.1
    confirm: bool = True
    held_out: float = 1 / 3
    strength: tuple[float, ...] = (1.0,) * MUSCLES

    def __post_init__(self) -> None:
        """Refuse a protocol without trials, or with times that are none."""
        if not self.trials:
            raise MisfitError("a protocol without trials; add [[trials]] or [study]")
        Trial(self.rest, (0.0,) * MUSCLES)
        for name in ("move_speed", "stimulate_s", "rise_s"):
            if not 0.0 < getattr(self, name) <= _LONGEST_S:
                raise MisfitError(f"{name} = {getattr(self, name)!r}; a positive number was expected")
        for name in ("settle_s", "announce_s"):
            if not 0.0 <= getattr(self, name) <= _LONGEST_S:
                raise MisfitError(
                    f"{name} = {getattr(self, name)!r} s; a time between 0 and {_LONGEST_S:g} s was expected"
                )
        if not self.stimulate_s > 2 * self.rise_s:
            raise MisfitError(f"activations rise and fall in {self.rise_s:g} s each, within {self.stimulate_s:g} s")
        if len(self.strength) != MUSCLES or not all(0.0 <= share <= 2.0 for share in self.strength):
            raise MisfitError(f"strength = {list(self.strength)}; six shares between 0 and 2 were expected")
        if not 0.0 <= self.held_out < 1.0:
            raise MisfitError(f"held_out = {self.held_out!r}; a share of the trials below 1 was expected")

    def to_json(self) -> dict[str, Any]:
        """All of it, for a recording."""
        return asdict(self)


def protocol_of_json(document: Mapping[str, Any]) -> Protocol:
    """The protocol of a recording."""
    trials = tuple(Trial(tuple(each["posture"]), tuple(each["activations"])) for each in document["trials"])
    lists = {name: tuple(document[name]) for name in ("rest", "strength") if name in document}
    return Protocol(**{**document, "trials": trials, **lists})


def read_protocol(source: str) -> Protocol:
    """Read a protocol file, or the one of the study by the name `study`.

    Raises:
        MisfitError: if there is no such file, or it says what cannot be.
    """
    shipped = files("hil.trials") / f"{source}.toml"
    try:
        text = shipped.read_text() if source.isidentifier() and shipped.is_file() else Path(source).read_text()
        document = tomllib.loads(text)
    except OSError as error:
        raise MisfitError(f"{source} cannot be read: {error.strerror}; name a protocol file, or `study`") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise MisfitError(f"{source} is no TOML file: {error}") from error
    try:
        return _protocol(document)
    except MisfitError as error:
        raise MisfitError(f"{source}: {error}") from error
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise MisfitError(f"{source} has a value of the wrong kind: {error}; see docs/bench.md") from error


def _protocol(document: dict[str, Any]) -> Protocol:
    trials = [_trial(each) for each in document.pop("trials", [])]
    if "study" in document:
        trials += _study(document.pop("study"))
    _known(document, [field.name for field in fields(Protocol)[1:]], "the protocol")
    for name in ("rest", "strength"):
        if name in document:
            document[name] = tuple(map(float, document[name]))
    if not isinstance(document.get("confirm", True), bool):
        raise MisfitError(f"confirm = {json.dumps(document['confirm'])}; true or false was expected")
    return Protocol(tuple(trials), **document)


def _trial(table: dict[str, Any]) -> Trial:
    _known(table, _TRIAL_KEYS, "[[trials]]")
    return Trial(tuple(map(float, table["posture"])), tuple(map(float, table["activations"])))


def _study(table: dict[str, Any]) -> list[Trial]:
    """Each posture so many times, in mixed order, each trial with activations drawn between 0 and the most."""
    _known(table, _STUDY_KEYS, "[study]")
    postures = np.array(table["postures"], dtype=float)
    random = np.random.default_rng(int(table.get("seed", 1)))
    order = random.permutation(np.repeat(np.arange(len(postures)), int(table.get("repeats", 3))))
    patterns = random.uniform(0.0, float(table.get("most", 1.0)), (len(order), MUSCLES))
    return [Trial(tuple(postures[k].tolist()), tuple(a.tolist())) for k, a in zip(order, patterns, strict=True)]


def _known(table: Mapping[str, Any], names: Any, where: str) -> None:
    for key in table:
        if key not in names:
            raise MisfitError(f"{where} has {key!r}, which is not known; there are {', '.join(names)}")
