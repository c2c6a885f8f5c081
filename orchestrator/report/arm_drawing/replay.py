"""A motion of the arm as a part of a page: the drawing beside its curves, play, pause and a slider; no network."""

import base64
import hashlib
import html
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from orchestrator.report.arm_drawing.arrows import HEAD, LARGEST_LENGTH, LARGEST_TURN, RADIUS, Scales
from orchestrator.report.arm_drawing.curves import Panel, curves_svg
from orchestrator.report.arm_drawing.shape import NOMINAL_ARM, TRUNK, ArmShape, Instant, strings
from orchestrator.report.arm_drawing.svg import arm_svg, described
from orchestrator.shown import drawing_of

# More are not seen: 25 a second over 16 s, in between the script interpolates.
MOST_FRAMES = 400
_FIELDS = ("q", "torque", "torque_std", "force", "activation", "modelled")


@dataclass(frozen=True, eq=False)
class Replay:
    """A motion: `time` (n,) s, increasing; the other series (n, 2), (n, 6) for activations, as in `Instant`; `panels` beside it."""

    time: np.ndarray
    q: np.ndarray
    torque: np.ndarray | None = None
    torque_std: np.ndarray | None = None
    force: np.ndarray | None = None
    activation: np.ndarray | None = None
    modelled: np.ndarray | None = None
    panels: tuple[Panel, ...] = ()
    shape: ArmShape = NOMINAL_ARM

    def instant(self, sample: int) -> Instant:
        """The arm at one sample."""
        found = {name: _row(getattr(self, name), sample) for name in _FIELDS}
        return Instant(time=float(self.time[sample]), **found)

    def frames(self) -> list[int]:
        """Samples that are shown, evenly, with the first and the last."""
        return sorted({round(k) for k in np.linspace(0, len(self.time) - 1, min(MOST_FRAMES, len(self.time)))})

    def _repr_html_(self) -> str:
        return drawing_of("replay").html(self)

    @property
    def worst(self) -> int:
        """The sample with the largest residual torque, or the farthest from the model: what is shown where nothing moves."""
        if self.torque is not None:
            return int(np.nanargmax(np.abs(self.torque).max(axis=1)))
        return 0 if self.modelled is None else int(np.nanargmax(np.abs(self.q - self.modelled).max(axis=1)))


def replay_html(replay: Replay, title: str) -> str:
    """Return the markup of a replay; `replay_style` and `replay_script` have to be on the page once.

    Without script or on paper it shows the moment of the largest residual torque.
    """
    frames = replay.frames()
    instants = [replay.instant(k) for k in frames]
    scales = Scales.of(replay.shape, instants)
    data = html.escape(json.dumps(_data(replay, frames, scales), separators=(",", ":")))
    begin, end = float(replay.time[0]), float(replay.time[-1])
    worst, moment = replay.instant(replay.worst), float(replay.time[replay.worst])
    curves = curves_svg(replay.time, replay.panels, moment) if replay.panels else ""
    return (
        f'<div class="arm-replay" role="group" aria-label="{html.escape(title)}" data-replay="{data}">'
        f'<div class="views"><div class="drawing">{arm_svg(worst, replay.shape, scales)}</div>{curves}</div>'
        '<div class="controls" hidden><button type="button" aria-label="Play">Play</button>'
        f'<input type="range" min="{begin:.6g}" max="{end:.6g}" step="any" value="{moment:.6g}" aria-label="Time"/>'
        f'<output>{moment:.2f} s</output></div><p class="readout">{html.escape(described(worst))}</p></div>'
    )


def _data(replay: Replay, frames: Sequence[int], scales: Scales) -> dict[str, Any]:
    """What the script needs: numbers to 1e-4 of their unit, a hundredth of a millimetre of the drawing."""
    series = {name: getattr(replay, name) for name in ("time", *_FIELDS)}
    kept = {name: np.round(np.asarray(v)[frames], 4).tolist() for name, v in series.items() if v is not None}
    shape = replay.shape
    return {
        **kept,
        "length": shape.length,
        "trunk": TRUNK,
        "strings": strings(shape),
        "turn": scales.turn,
        "reach": scales.length,
        "limits": [LARGEST_TURN, LARGEST_LENGTH, RADIUS, HEAD],
    }


def _row(values: np.ndarray | None, sample: int) -> Any:
    return None if values is None else tuple(float(value) for value in values[sample])


@cache
def replay_script() -> str:
    """Return the script that brings every replay on a page to life; `misfitArm.mount(element)` does one that came later."""
    return (Path(__file__).parent / "replay.js").read_text()


@cache
def script_source() -> str:
    """Return what a content security policy names to allow this script and no other, such as `'sha256-...'`."""
    digest = hashlib.sha256(replay_script().encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


@cache
def replay_style() -> str:
    """Return the style of replays; colours are the palette's variables."""
    return (Path(__file__).parent / "replay.css").read_text()
