"""What the comparison of two FMUs found, as sentences, tables and curves."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from nicegui import ui

from orchestrator.measurements.wording import counted
from orchestrator.report.arm_drawing.curves import Line, Panel, curves_svg
from orchestrator.report.numbers import digits, percent, quantity, unbroken
from orchestrator.report.page import PageTable
from orchestrator.report.palette import Colour
from orchestrator.studio.text import bullets, details, heading, page_table, paragraph

MOST_ROWS = 200


def swap_result(found: Mapping[str, Any]) -> None:
    """Show everything, the most important first."""
    paragraph(unbroken(verdict(found)), "studio-verdict")
    for name, run in zip(found["files"], found["runs"], strict=True):
        if run["error"]:
            paragraph(f"{name} did not run: {run['error']}", "studio-problem")
    if found.get("not_compared"):
        paragraph(found["not_compared"], "studio-problem")
    heading("Where they part")
    _trajectories(found)
    heading("How fast each runs")
    page_table(speed_table(found))
    heading("How their interfaces differ")
    _interface(found)


def verdict(found: Mapping[str, Any]) -> str:
    """The whole in one or two sentences."""
    breaking = sum(row["breaking"] for row in found["rows"])
    others = len(found["rows"]) - breaking
    if breaking:
        words = f"{counted(breaking, 'difference')} of the interfaces would break a system"
        words += f", {others} would not." if others else "."
    else:
        words = "The interface of the new one fits where the old one is"
        words += f"; {counted(others, 'difference')} would break no system." if others else "."
    silent = [name for name, run in zip(found["files"], found["runs"], strict=True) if run["error"]]
    if silent:
        return f"{' and '.join(silent)} did not run, so nothing is known of what {'it does' if len(silent) == 1 else 'they do'}. {words}"
    parted = [signal for signal in found["signals"] if signal["parted_at"] is not None]
    moved = [signal for signal in found["signals"] if _number(signal["spread"]) > 0.0]
    if parted:
        first = parted[0]
        worst = quantity(_number(first["largest"]), first["unit"])
        when = f"{_number(first['parted_at']):.4g} s"
        return f"{words} They do not do the same: outputs part first at {when}, in {first['name']}, which gets {worst} apart."
    if not found["signals"]:
        return f"{words} They have no output in common, so what they do was not compared."
    if not moved:
        return (
            f"Nothing was exercised: {counted(len(found['signals']), 'output')} stayed constant in both, so it is not known "
            f"whether they agree. Drive the inputs otherwise. {words}"
        )
    still = len(found["signals"]) - len(moved)
    rest = f" {still} more stayed constant." if still else ""
    agree = f"{counted(len(moved), 'output')} that moved {'agrees' if len(moved) == 1 else 'agree'}"
    return (
        f"{words} {agree} within {percent(found['tolerance'])} of {'its' if len(moved) == 1 else 'their'} range.{rest}"
    )


def _trajectories(found: Mapping[str, Any]) -> None:
    if not found["signals"]:
        ran = not any(run["error"] for run in found["runs"])
        paragraph(
            f"{'There is no output that both have' if ran else 'Not both of them ran'}, and so there is nothing to compare."
        )
        return
    page_table(signals_table(found))
    signals = {signal["name"]: signal for signal in found["signals"]}
    with ui.element("div").classes("studio-columns"):
        for curve in found["curves"]:
            ui.html(curve_picture(curve, signals[curve["name"]], found["files"]), sanitize=False)
    paragraph("The upright line is the moment at which both part.", "studio-hint")


def curve_picture(curve: Mapping[str, Any], signal: Mapping[str, Any], files: list[str]) -> str:
    """Both curves of a signal over time, with a mark where they part."""
    time, old, new = (np.array([_number(x) for x in curve[name]]) for name in ("time", "old", "new"))
    lines = (Line("old", Colour.MEASURED, old), Line("new", Colour.MODEL, new, dashed=True))
    return curves_svg(time, [Panel(curve["name"], signal["unit"], lines)], mark=signal["parted_at"])


def signals_table(found: Mapping[str, Any]) -> PageTable:
    """One signal a row, the first to part first."""
    rows = []
    for each in found["signals"][:MOST_ROWS]:
        unit, largest, spread = each["unit"], _number(each["largest"]), _number(each["spread"])
        parted = "never" if each["parted_at"] is None else f"{each['parted_at']:.4g} s"
        at = f"{quantity(largest, unit)} at {each['largest_at']:.4g} s"
        share = percent(largest / spread) if spread else "the old one is constant"
        rows.append((each["name"], parted, at, quantity(_number(each["rms"]), unit), share))
    caption = (
        f"Signals that both have, run to {found['stop']:g} s; equal within {percent(found['tolerance'])} of the range"
    )
    return PageTable(caption, ("signal", "parts at", "largest difference", "rms", "share of its range"), tuple(rows))


def speed_table(found: Mapping[str, Any]) -> PageTable:
    """One FMU a row; both ran in processes of their own, one after the other."""
    seconds = [_number(run.get("seconds")) for run in found["runs"]]
    rows = []
    for name, run, took in zip(found["files"], found["runs"], seconds, strict=True):
        if run["error"]:
            rows.append((name, "did not run", "", "", ""))
            continue
        ratio = f"{digits(took / seconds[0])} times" if seconds[0] and np.isfinite(seconds[0]) else ""
        pace = digits(_number(run["times_real_time"]))
        rows.append((name, quantity(took, "s"), quantity(run["preparing_s"], "s"), f"{pace} times real time", ratio))
    headings = ("FMU", "run", "loading", "pace", "of the old one's time")
    return PageTable("Clock time on this machine, in a process of its own, steps included", headings, tuple(rows))


def interface_table(found: Mapping[str, Any]) -> PageTable:
    """One difference a row, what breaks first."""
    rows = tuple(
        (row["variable"], row["what"], row["old"], row["new"], "breaking" if row["breaking"] else "compatible")
        for row in found["rows"][:MOST_ROWS]
    )
    left = len(found["rows"]) - MOST_ROWS
    caption = "Differences of the interfaces" + (f"; {left} more are not shown" if left > 0 else "")
    return PageTable(caption, ("variable", "what", "old", "new", "for a system"), rows)


def _interface(found: Mapping[str, Any]) -> None:
    if found["rows"]:
        page_table(interface_table(found))
    else:
        paragraph("They do not differ: names, causalities, variabilities, types, units and start values are the same.")
    lines = [*found["breaking"], *found["compatible"]]
    if lines:
        with details(f"In sentences ({len(lines)}); a release with these changes is a {found['level']} version"):
            bullets(lines[:MOST_ROWS])


def _number(value: Any) -> float:
    """A number that JSON may hold as a word."""
    return float("nan") if value is None else float(value)
