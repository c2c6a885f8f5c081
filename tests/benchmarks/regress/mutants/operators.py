"""One-line changes to Modelica text, by the rows of the usual tables of mutation operators."""

import re
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass

from tests.benchmarks.regress.mutants.source_text import Line, arguments_of, end_of_term, lines_of

NUMBER = re.compile(r"(?<![\w.\]])(\d+\.?\d*(?:[eE][-+]?\d+)?)(?![\w.])")
FACTORS = (0.95, 1.05, 1.2, -1.0)
UNIT_SLIPS = (1000.0, 0.017453292519943295)


@dataclass(frozen=True)
class Change:
    """Columns [begin, end) of a line get another text; `row` is the operator's row, `what` says it in words."""

    row: str
    line: int
    begin: int
    end: int
    text: str
    what: str

    def apply(self, source: str) -> str:
        """Return the source with this change."""
        lines = source.splitlines(keepends=True)
        line = lines[self.line]
        lines[self.line] = line[: self.begin] + self.text + line[self.end :]
        return "".join(lines)


def changes_of(source: str, outputs: Collection[str]) -> list[Change]:
    """Return every change of every row that fits into a source; `outputs` are the outputs of its class."""
    found: list[Change] = []
    for line in lines_of(source):
        for row, make in ROWS.items():
            found += [
                Change(row, line.number, begin, end, text, what)
                for begin, end, text, what in make(line)
                if line.code[begin:end] != text
            ]
        found += [Change("signal", line.number, *each) for each in _signal(line, outputs)]
    return found


_Place = tuple[int, int, str, str]


def _values(line: Line) -> Iterator[re.Match[str]]:
    """Numbers that declarations give to parameters, constants and modifiers, without limits and sizes."""
    if line.is_equation or not re.match(r"\s*(parameter|constant|[\w.]+\(|d1|d2)", line.code):
        return
    for found in NUMBER.finditer(line.code):
        before = line.code[: found.start()]
        named = re.search(r"(\w+)(?:\[[^\]]*\])?\s*=[^=]*$", before)
        open_limits = re.search(r"\((?:each )?(?:min|max)=[^)]*$", before)
        if named and not open_limits and named.group(1) not in ("min", "max", "n", "start", "unit"):
            yield found


def _parameter(line: Line) -> Iterator[_Place]:
    for found in _values(line):
        value = float(found.group())
        for factor in FACTORS:
            if value != 0.0:
                yield found.start(), found.end(), f"({value * factor:.9g})", f"value x {factor:g}"
    for found in re.finditer(r"\{([^{},]+), ([^{},]+)", line.code):
        if not line.is_equation and "=" in line.code[: found.start()]:
            yield found.start(1), found.end(2), f"{found.group(2)}, {found.group(1)}", "two like values swapped"


def _unit(line: Line) -> Iterator[_Place]:
    for found in _values(line):
        for factor in UNIT_SLIPS:
            if float(found.group()) != 0.0:
                yield found.start(), found.end(), f"{float(found.group()) * factor:.9g}", f"unit slip x {factor:.4g}"


def _sign(line: Line) -> Iterator[_Place]:
    if line.is_equation:
        for found in re.finditer(r"(?<=[\w\])}]) ([+-]) ", line.code):
            other = "-" if found.group(1) == "+" else "+"
            yield found.start(1), found.end(1), other, f"{found.group(1)} became {other}"
        for found in re.finditer(r"(?<=[=(,{] )-(?=[\w(])|(?<=[=(,{])-(?=[\w(])", line.code):
            yield found.start(), found.end(), "", "minus dropped"


def _term(line: Line) -> Iterator[_Place]:
    if not line.is_equation:
        return
    for found in re.finditer(r"(?<=[\w\])}]) ([+-] )", line.code):
        end = end_of_term(line.code, found.end())
        yield found.start(), end, "", f"term {line.code[found.start() : end].strip()} dropped"
    for found in re.finditer(r"(?<=[\w\])}])([*/])(?=[\w(])", line.code):
        other = "/" if found.group() == "*" else "*"
        yield found.start(), found.end(), other, f"{found.group()} became {other}"
    for found in re.finditer(r"\^2", line.code):
        yield found.start(), found.end(), "", "square dropped"
    for one, other in (("sin", "cos"), ("cos", "sin"), ("tanh", ""), ("sqrt", ""), ("abs", ""), ("exp", "")):
        for found in re.finditer(rf"\b{one}(?=\()", line.code):
            yield found.start(), found.end(), other, f"{one} became {other}" if other else f"{one} dropped"


def _relation(line: Line) -> Iterator[_Place]:
    if not line.is_equation:
        return
    for found in re.finditer(r"(?<= )(<=|>=|<|>)(?= )", line.code):
        for other in ("<", "<=", ">", ">="):
            if other != found.group():
                yield found.start(), found.end(), other, f"{found.group()} became {other}"
        end = end_of_term(line.code, found.end() + 1)
        side = line.code[found.end() : end].strip()
        yield found.end(), end, f" {side} + 0.02", f"threshold {side} shifted by 0.02"
    for found in re.finditer(r"\bif (.*?) then", line.code):
        for forced in ("true", "false"):
            yield found.start(1), found.end(1), forced, f"condition is always {forced}"


def _limit(line: Line) -> Iterator[_Place]:
    if not line.is_equation:
        return
    for found in re.finditer(r"\b(min|max)(?=\()", line.code):
        other = "max" if found.group() == "min" else "min"
        yield found.start(), found.end(), other, f"{found.group()} became {other}"
        arguments, end = arguments_of(line.code, found.end())
        if len(arguments) == 2:
            for kept in arguments:
                yield found.start(), end + 1, f"({kept.strip()})", f"{found.group()} dropped, {kept.strip()} stays"
        if len(arguments) == 2 and arguments[0].strip() != "0":
            begin = found.end() + 1
            yield begin, begin + len(arguments[0]), f"1.5*({arguments[0]})", "first side of the limit x 1.5"


def _delay(line: Line) -> Iterator[_Place]:
    if not line.is_equation:
        return
    for found in re.finditer(r"\bdelay(?=\()", line.code):
        arguments, end = arguments_of(line.code, found.end())
        if len(arguments) == 3:
            value, time, longest = (each.strip() for each in arguments)
            yield found.start(), end + 1, value, "delay dropped"
            for text, what in (
                (f"2*{time}", "doubled"),
                (f"0.5*{time}", "halved"),
                (f"{time} + 0.001*{longest}", "longer"),
            ):
                yield found.start(), end + 1, f"delay({value}, {text}, {longest})", f"delay {what}"
    for found in re.finditer(r"(?<=/)(tau\w*|T\w*)\b", line.code):
        yield found.start(), found.end(), f"(1.2*{found.group()})", f"lag {found.group()} x 1.2"
        yield found.start(), found.end(), f"(0.5*{found.group()})", f"lag {found.group()} halved"


def _frame(line: Line) -> Iterator[_Place]:
    if not line.is_equation:
        return
    for found in re.finditer(r"\[([12])\]", line.code):
        other = "2" if found.group(1) == "1" else "1"
        yield found.start(1), found.end(1), other, f"axis {found.group(1)} became {other}"
    for found in re.finditer(r"\[([12]), ([12])\]", line.code):
        yield found.start(), found.end(), f"[{found.group(2)}, {found.group(1)}]", "transposed"
    for found in re.finditer(r"\{([^{},]+), ([^{},]+)\}", line.code):
        yield found.start(), found.end(), f"{{{found.group(2)}, {found.group(1)}}}", "axes swapped"
        yield found.start(), found.end(), f"{{-({found.group(1)}), {found.group(2)}}}", "first axis turned round"


def _initial_value(line: Line) -> Iterator[_Place]:
    if line.is_equation or not re.search(r"\bfixed=true|level\d\(start", line.code):
        return
    for found in re.finditer(r"(?<=start=)\{([^}]*)\}|(?<=start=)([-\d.]+)", line.code):
        for number in NUMBER.finditer(line.code, found.start(), found.end()):
            value = float(number.group())
            yield number.start(), number.end(), f"{value + 0.05:.9g}", "start + 0.05"
            if value != 0.0:
                yield number.start(), number.end(), f"{0.9 * value:.9g}", "start x 0.9"


def _signal(line: Line, outputs: Collection[str]) -> Iterator[_Place]:
    found = re.match(r"\s*(\w+) = (.*);\s*$", line.code) if line.is_equation else None
    if found and found.group(1) in outputs:
        begin, end, formula = found.start(2), found.end(2), found.group(2)
        yield begin, end, f"1.01*({formula})", f"reading of {found.group(1)} x 1.01"
        yield begin, end, f"0.5*({formula})", f"reading of {found.group(1)} halved"
        yield begin, end, f"-({formula})", f"reading of {found.group(1)} turned round"
        yield begin, end, f"0*({formula})", f"reading of {found.group(1)} stuck at 0"
        yield begin, end, f"({formula})*(1 + 0.02*sin(50*time))", f"noise on the reading of {found.group(1)}"


ROWS: dict[str, Callable[[Line], Iterator[_Place]]] = {
    "parameter": _parameter,
    "sign": _sign,
    "term": _term,
    "unit": _unit,
    "relation": _relation,
    "limit": _limit,
    "delay": _delay,
    "frame": _frame,
    "initial value": _initial_value,
}
ALL_ROWS = (*ROWS, "signal")
