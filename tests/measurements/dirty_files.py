"""One recording of a drive, written as 15 programs would have written it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

RATE = 100.0
SAMPLES = 300
KINDS = (
    "semicolons and decimal commas",
    "tabs, units in brackets, degrees",
    "UTF-16 with a byte order mark",
    "UTF-8 with a byte order mark, spreadsheet",
    "Latin-1 with a row of units",
    "lines of comments above the header",
    "a logger's preamble with a colon",
    "ISO stamps",
    "epoch in ms",
    "times of the day past midnight",
    "date and time in two columns",
    "holes, markers and a long gap",
    "rows out of order, a copy, a last line",
    "quoted cells, remarks and other names",
    "no time, the rate in the preamble",
)


@cache
def recording() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time in s, torque in N.m that is held for 0.1 s, and the angle in rad of the built-in drive, with noise."""
    from orchestrator.model_argument import load_model

    rng = np.random.default_rng(7)
    time = np.arange(SAMPLES) / RATE
    torque = 0.2 * np.interp(time, np.linspace(0.0, time[-1], 31), rng.normal(size=31))
    model = load_model("drive")
    inputs = np.column_stack([torque if v.name == "torque" else np.zeros_like(time) for v in model.inputs])
    angle = model.simulate(time, inputs, ["phi"], {"q": 0.0, "w": 0.0})[:, 0]
    return time, torque, angle + 1e-3 * rng.normal(size=SAMPLES)


@dataclass(frozen=True)
class Dirty:
    """A file as bytes, its ending, and which of its rows (None: all) are left after the import."""

    content: bytes
    ending: str = ".csv"
    kept: int = SAMPLES
    options: tuple[str, ...] = ()


def _table(header: str, row: Callable[..., str], end: str = "\n") -> str:
    time, torque, angle = recording()
    lines = [row(*values) for values in zip(time, torque, angle, strict=True)]
    return header + end.join(lines) + end


def _comma(value: float, digits: int = 6) -> str:
    return f"{value:.{digits}f}".replace(".", ",")


def _clock(t: float) -> str:
    seconds = 86395.0 + t
    return f"{int(seconds // 3600) % 24:02}:{int(seconds // 60) % 60:02}:{seconds % 60:06.3f}"


def _with_holes() -> str:
    lines = _table("time,torque,phi\n", lambda t, u, q: f"{t:.2f},{u:.6f},{q:.6f}").splitlines()
    for place, hole in ((20, "NaN"), (41, ""), (42, "n/a"), (120, "-9999"), (121, "-9999")):
        lines[place] = ",".join([*lines[place].split(",")[:2], hole])
    for place in range(200, 230):
        lines[place] = ",".join([*lines[place].split(",")[:2], ""])
    return "\n".join(lines)


def _shuffled() -> str:
    lines = _table("t,torque,phi\n", lambda t, u, q: f"{t:.2f},{u:.6f},{q:.6f}").splitlines()
    lines[51], lines[52] = lines[52], lines[51]
    return "\n".join([*lines[:100], lines[99], *lines[100:], "End of recording"])


@cache
def dirty_files() -> dict[str, Dirty]:
    """All of them, by what is dirty."""
    deg = 180.0 / np.pi
    epoch = 1_700_000_000
    return {
        "semicolons and decimal commas": Dirty(
            _table("time;torque;phi\n", lambda t, u, q: ";".join(map(_comma, (t, u, q)))).encode()
        ),
        "tabs, units in brackets, degrees": Dirty(
            _table("Time [s]\tTorque [Nm]\tphi [deg]\n", lambda t, u, q: f"{t:.3f}\t{u:.6f}\t{q * deg:.5f}").encode(),
            ".txt",
        ),
        "UTF-16 with a byte order mark": Dirty(
            _table("time,torque,phi\r\n", lambda t, u, q: f"{t:.3f},{u:.6f},{q:.6f}", "\r\n").encode("utf-16")
        ),
        "UTF-8 with a byte order mark, spreadsheet": Dirty(
            _table(
                "\ufeffZeit (ms);torque (mNm);phi (°)\r\n",
                lambda t, u, q: f"{t * 1e3:.0f};{_comma(u * 1e3)};{_comma(q * deg)}",
                "\r\n",
            ).encode()
        ),
        "Latin-1 with a row of units": Dirty(
            _table("time;torque;phi\ns;N·m;°\n", lambda t, u, q: f"{t:.3f};{u:.6f};{q * deg:.5f}").encode("latin-1")
        ),
        "lines of comments above the header": Dirty(
            _table(
                "# rig 4, operator K. Weber\n# 2024-03-01 12:00, gain 3;4;5\n#\n# time_s torque_Nm phi_rad\n",
                lambda t, u, q: f"{t:.3f}  {u: .6f}   {q: .6f}",
            ).encode(),
            ".dat",
        ),
        "a logger's preamble with a colon": Dirty(
            _table(
                "Device: XY-3\nSerial,12\nNotes: none\n\nTime/s,Torque/N.m,Phi/rad,\n",
                lambda t, u, q: f"{t:.3f},{u:.6f},{q:.6f},",
            ).encode()
        ),
        "ISO stamps": Dirty(
            _table(
                "timestamp,torque,phi\n",
                lambda t, u, q: f"2024-03-01T12:00:{t:06.3f}Z,{u:.6f},{q:.6f}",
            ).encode()
        ),
        "epoch in ms": Dirty(
            _table("stamp,torque,phi\n", lambda t, u, q: f"{round((epoch + t) * 1000)},{u:.6f},{q:.6f}").encode()
        ),
        "times of the day past midnight": Dirty(
            _table("Uhrzeit;torque;phi\n", lambda t, u, q: f"{_clock(3 * t)};{_comma(u)};{_comma(q)}").encode()
        ),
        "date and time in two columns": Dirty(
            _table(
                "Date;Time;torque;phi\n",
                lambda t, u, q: f"01.03.2024;12:00:{t:06.3f};{_comma(u)};{_comma(q)}".replace(".0", ".0"),
            ).encode()
        ),
        "holes, markers and a long gap": Dirty(_with_holes().encode(), kept=SAMPLES - 30),
        "rows out of order, a copy, a last line": Dirty(_shuffled().encode()),
        "quoted cells, remarks and other names": Dirty(
            _table(
                '"Elapsed (s)","Motor torque (N*m)","Angle phi (rad)","state"\n',
                lambda t, u, q: f'"{t:.3f}","{u:.6f}","{q:.6f}","running, ok"',
            ).encode()
        ),
        "no time, the rate in the preamble": Dirty(
            _table("Sampling rate: 100 Hz\ntorque [N.m]\tphi [rad]\n", lambda t, u, q: f"{u:.6f}\t{q:.6f}").encode(),
            ".asc",
        ),
    }
