"""Share of single effects named right against ENR and record length, as a table and as a picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tests.benchmarks.diagnosis.scoring.paper import new_figure, save
from tests.benchmarks.diagnosis.scoring.wilson import Share

Cells = dict[tuple[float, float], Share]


def map_cells(rows: Sequence[dict[str, Any]], score: str = "class") -> Cells:
    """Share right for each (ENR, seconds of a trial) of the cases that were drawn for the map.

    Effects whose bounds keep them from the wanted ENR by more than a half do not count.
    """
    drawn = [r for r in rows if r["family"] == "S" and r["wanted_enr"] is not None]
    drawn = [r for r in drawn if 2 / 3 < r["enr"] / r["wanted_enr"] < 1.5]
    keys = sorted({(r["wanted_enr"], r["record_seconds"]) for r in drawn})
    return {
        key: Share.of(bool(r[score]) for r in drawn if (r["wanted_enr"], r["record_seconds"]) == key) for key in keys
    }


def map_table(cells: Cells) -> str:
    """The map as markdown: a row for each ENR, a column for each record length."""
    lengths = sorted({seconds for _, seconds in cells})
    lines = ["| ENR | " + " | ".join(f"{s:g} s" for s in lengths) + " |", "|---" * (len(lengths) + 1) + "|"]
    for enr in sorted({enr for enr, _ in cells}):
        lines.append(f"| {enr:g} | " + " | ".join(str(cells.get((enr, s), Share(0, 0))) for s in lengths) + " |")
    return "\n".join(lines)


def draw_map(panels: dict[str, Cells], path: Path) -> None:
    """Draw one panel for each method; every cell shows the share and its 95 % interval, so grey is enough."""
    figure, axes = new_figure(1, len(panels), (3.6 * len(panels), 3.4))
    for axis, (title, cells) in zip(axes[0], panels.items(), strict=True):
        enrs, lengths = sorted({e for e, _ in cells}), sorted({s for _, s in cells})
        shares = [[cells.get((e, s), Share(0, 0)).value or 0.0 for s in lengths] for e in enrs]
        axis.imshow(shares, cmap="Greys", vmin=0, vmax=1, origin="lower", aspect="auto")
        for i, enr in enumerate(enrs):
            for j, seconds in enumerate(lengths):
                cell = cells.get((enr, seconds), Share(0, 0))
                low, high = cell.interval
                colour = "white" if (cell.value or 0) > 0.5 else "black"
                text = f"{cell.hits}/{cell.n}\n{100 * low:.0f}-{100 * high:.0f} %"
                axis.text(j, i, text, ha="center", va="center", color=colour, fontsize=8)
        axis.set(title=title, xlabel="length of a trial, s", ylabel="effect / noise")
        axis.set_xticks(range(len(lengths)), [f"{s:g}" for s in lengths])
        axis.set_yticks(range(len(enrs)), [f"{e:g}" for e in enrs])
    save(figure, path)
