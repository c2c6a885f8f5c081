"""One recording of a drive, written as 41 programs would have written it."""

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
    "a spreadsheet that names its separator, cells at the end",
    "LabVIEW, two headers with numbers",
    "a quoted row of units in brackets",
    "days since the year 0",
    "stamps with a blank, a decimal comma and a zone",
    "month first, AM and PM",
    "Fortran exponents, units in capitals",
    "remarks between the rows",
    "a table drawn with bars and dashes",
    "UTF-16 without a mark",
    "statistics below the table",
    "four lines of header",
    "columns of words",
    "units behind underscores",
    "names of a robot's topics, ns",
    "digits in groups, signs of a word processor",
    "digits in groups of apostrophes",
    "milliseconds behind a colon",
    "every row twice",
    "headers over two lines",
    "UTF-16, a clock put forward, units in a row, gaps",
    "thousands, the same name twice, units in a row",
    "quoted thousands, a mark, a column twice",
    "joined logs, lines of an old Mac",
    "stamps of digits alone",
    "one value in a row",
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


def _labview() -> str:
    head = (
        "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nTime\t12:00:00,000\n***End_of_Header***\t\n\t\n"
    )
    head += "Channels\t2\t\t\nSamples\t300\t300\t\nTime\t12:00:00,0\t12:00:00,0\t\nX0\t0,0E+0\t0,0E+0\t\n"
    head += "Delta_X\t0,010000\t0,010000\t\n***End_of_Header***\t\t\t\nX_Value\ttorque\tphi\tComment\n"
    return _table(head, lambda *row: "\t".join(map(_comma, row)) + "\t")


def _half_day(t: float) -> str:
    return f"3/13/2024 11:59:{58 + t:06.3f} AM" if t < 2.0 else f"3/13/2024 12:00:{t - 2.0:06.3f} PM"


def _with_remarks() -> str:
    lines = _table("% rig 7\n% time torque phi\n", lambda t, u, q: f"{t:.2f} {u:.6f} {q:.6f}").splitlines()
    return "\n".join([*lines[:100], "% operator touched the shaft", *lines[100:200], "// a note", *lines[200:]])


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


def _put_forward() -> str:
    """A logger at night, when summer time begins: the record goes on, its clock jumps by an hour."""
    time, torque, angle = recording()
    lines = ["Zeitstempel;Drehmoment;Winkel phi;Status", "[ISO 8601];[mN·m];[°];[-]"]
    for k, (t, u, q) in enumerate(zip(time, torque, angle, strict=True)):
        clock = f"01:59:{58 + t:06.3f}+01:00" if t < 1.995 else f"03:00:{t - 2:06.3f}+02:00"
        degrees = "" if k in (40, 41, 90) else _comma(q * 180 / np.pi, 5)
        if not 150 <= k < 155:
            lines.append(f"2024-03-31T{clock};{_comma(u * 1e3, 4)};{degrees};OK")
    return "\r\n".join(lines)


def _joined_logs() -> str:
    lines = _table("time|torque|phi\n", lambda t, u, q: f"{1711846798 + t:.3f}|{u:.6f}|{q:.6f}").splitlines()
    return "\r".join([*lines[:120], lines[0], *lines[120:]])


def _thousands(value: float, digits: int) -> str:
    return f"{value:,.{digits}f}".translate(str.maketrans(",.", ".,"))


def _one_value_in_a_row() -> str:
    lines = ["_time,_measurement,_field,_value,unit"]
    for t, u, q in zip(*recording(), strict=True):
        for name, value, unit in (("torque", u, "Nm"), ("phi", q * 180 / np.pi, "°")):
            lines.append(f"2024-03-01T12:00:{t:012.9f}Z,rig7,{name},{value:.6f},{unit}")
    return "\n".join(lines)


def _grouped(value: float, blank: str) -> str:
    return f"{value:,.1f}".replace(",", blank)


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
            _table("timestamp,torque,phi\n", lambda t, u, q: f"2024-03-01T12:00:{t:06.3f}Z,{u:.6f},{q:.6f}").encode()
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
        "a spreadsheet that names its separator, cells at the end": Dirty(
            _table(
                "sep=;\r\nZeit [s];torque [Nm];phi [rad];;\r\n", lambda *row: ";".join(map(_comma, row)) + ";;", "\r\n"
            ).encode("cp1252")
        ),
        "LabVIEW, two headers with numbers": Dirty(_labview().encode(), ".txt"),
        "a quoted row of units in brackets": Dirty(
            _table(
                '"time";"torque";"phi"\n"(s)";"(Nm)";"(deg)"\n', lambda t, u, q: f'"{t:.3f}";"{u:.6f}";"{q * deg:.5f}"'
            ).encode()
        ),
        "days since the year 0": Dirty(
            _table("datenum,torque,phi\n", lambda t, u, q: f"{739312.5 + t / 86400:.10f},{u:.6f},{q:.6f}").encode()
        ),
        "stamps with a blank, a decimal comma and a zone": Dirty(
            _table(
                "Zeitpunkt\ttorque\tphi\n",
                lambda t, u, q: f"2024-03-01 12:00:{t:06.3f}".replace(".", ",") + f"+01:00\t{_comma(u)}\t{_comma(q)}",
            ).encode()
        ),
        "month first, AM and PM": Dirty(
            _table("Timestamp,torque,phi\n", lambda t, u, q: f"{_half_day(t)},{u:.6f},{q:.6f}").encode()
        ),
        "Fortran exponents, units in capitals": Dirty(
            _table(
                "   TIME        TORQUE        PHI\n    S           N*M          RAD\n",
                lambda t, u, q: f"{t:16.8E}{u:16.8E}{q:16.8E}".replace("E", "D"),
            ).encode(),
            ".dat",
        ),
        "remarks between the rows": Dirty(_with_remarks().encode(), ".dat"),
        "a table drawn with bars and dashes": Dirty(
            _table(
                "| time | torque | phi |\n|------|------|------|\n", lambda t, u, q: f"| {t:.3f} | {u:.6f} | {q:.6f} |"
            ).encode(),
            ".txt",
        ),
        "UTF-16 without a mark": Dirty(
            _table("time\ttorque\tphi\r\n", lambda t, u, q: f"{t:.3f}\t{u:.6f}\t{q:.6f}", "\r\n").encode("utf-16-le")
        ),
        "statistics below the table": Dirty(
            _table("time;torque;phi\n", lambda *row: ";".join(map(_comma, row))).encode()
            + b"\nMin;-0,4;-0,1\nMax;0,4;2,1\nMean;0,0;0,3\n"
        ),
        "four lines of header": Dirty(
            _table(
                "CAN1;CAN1;CAN2\ntime;torque;phi\nTime since start;Motor torque;Encoder angle\ns;Nm;rad\n",
                lambda *row: ";".join(map(_comma, row)),
            ).encode()
        ),
        "columns of words": Dirty(
            _table(
                "time;enabled;mode;torque;phi\n",
                lambda t, u, q: f"{t:.3f};{'TRUE' if t > 1 else 'FALSE'};RUN;{u:.6f};{q:.6f}",
            ).encode()
        ),
        "units behind underscores": Dirty(
            _table("t_ms,torque_mNm,phi_mrad\n", lambda t, u, q: f"{t * 1e3:.0f},{u * 1e3:.4f},{q * 1e3:.4f}").encode()
        ),
        "names of a robot's topics, ns": Dirty(
            _table(
                "time_ns,torque.data,phi.data,header.stamp\n",
                lambda t, u, q: f"{int(round(t * 1e9))},{u:.6f},{q:.6f},{epoch + t:.3f}",
            ).encode()
        ),
        "digits in groups, signs of a word processor": Dirty(
            _table(
                "time [ms];torque [uN.m];phi [urad]\n",
                lambda t, u, q: ";".join(_grouped(x, "\u202f") for x in (t * 1e3, u * 1e6, q * 1e6)).replace(
                    "-", "\u2212"
                ),
            ).encode()
        ),
        "digits in groups of apostrophes": Dirty(
            _table(
                "time [ms];torque [uN.m];phi [urad]\n",
                lambda t, u, q: ";".join(_grouped(x, "'") for x in (t * 1e3, u * 1e6, q * 1e6)),
            ).encode()
        ),
        "milliseconds behind a colon": Dirty(
            _table(
                "clock,torque,phi\n", lambda t, u, q: f"12:00:{t:06.3f}".replace(".", ":") + f",{u:.6f},{q:.6f}"
            ).encode()
        ),
        "every row twice": Dirty(
            _table("time,torque,phi\n", lambda t, u, q: "\n".join(2 * [f"{t:.2f},{u:.6f},{q:.6f}"])).encode()
        ),
        "headers over two lines": Dirty(
            _table(
                '"Time\n[s]","Torque\n[Nm]","phi\n[deg]"\n', lambda t, u, q: f"{t:.2f},{u:.6f},{q * deg:.5f}"
            ).encode()
        ),
        "UTF-16, a clock put forward, units in a row, gaps": Dirty(_put_forward().encode("utf-16"), kept=SAMPLES - 5),
        "thousands, the same name twice, units in a row": Dirty(
            _table(
                "sep=;\nZeit [ms];Kanal 1;Kanal 1;Bemerkung;;\nms;µN·m;mrad;;;\n",
                lambda t, u, q: f"{_thousands(t * 1e3, 1)};{_thousands(u * 1e6, 1)};{_thousands(q * 1e3, 4)};;;",
            ).encode("cp1252")
        ),
        "quoted thousands, a mark, a column twice": Dirty(
            _table(
                '\ufeff"Time (ms)","Torque (mN-m)","Position, phi (deg)","Position, phi (deg)"\n',
                lambda t, u, q: f'"{1000 + t * 1e3:,.1f}","{u * 1e3:,.4f}","{q * deg:,.5f}","{q * deg:,.5f}"',
            ).encode()
        ),
        "joined logs, lines of an old Mac": Dirty(_joined_logs().encode(), ".log"),
        "stamps of digits alone": Dirty(
            _table(
                "  Stamp   torque/Nm   phi/rad\n",
                lambda t, u, q: f"202403011200{t:06.3f}".replace(".", ",") + f"  {_comma(u)}  {_comma(q)}",
            ).encode(),
            ".dat",
        ),
        "one value in a row": Dirty(_one_value_in_a_row().encode()),
    }
