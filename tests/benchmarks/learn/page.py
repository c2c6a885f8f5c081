"""The page of what learned blocks are worth, from the rows of the cases."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

# An error that rises by less than this share, or by less than this share of the noise, is as before.
SHARE, OF_NOISE = 0.02, 0.1


def worse(row: Mapping[str, Any]) -> bool:
    """Whether free runs are further off with what `misfit learn` wrote, on held-out trials or on those it never saw."""
    pairs = [(row["without"], row["with_block"]), (row["without_unseen"], row["with_unseen"])]
    return any(
        after > (1.0 + SHARE) * before + OF_NOISE * row["noise"] for before, after in pairs if before is not None
    )


def page(rows: Sequence[Mapping[str, Any]], seed: int, asked: int) -> str:
    """The page as Markdown."""
    shipped = [row for row in rows if row["without_unseen"] is None]
    fresh = [row for row in rows if row["without_unseen"] is not None]
    kept = [row for row in fresh if row["verdict"] != "refused"]
    bad = [row["name"] for row in rows if worse(row)]
    gains = [row["with_unseen"] / row["without_unseen"] for row in kept]
    return (
        "\n\n".join(
            [
                "# What learned blocks are worth",
                f"```\npython -m tests.benchmarks.learn.run --fresh {asked} --seed {seed} --report docs/benchmarks/learn.md\n```",
                "Each case is an arm with something hidden in it, simulated by a program that shares no code with the product. `misfit learn` "
                "gets four trials to learn from and two to judge its block by. Of fresh cases there are two more trials, drawn like the others, "
                "that it never sees: only they say what a block that was kept is worth, since the other two chose it. Errors are rms over "
                "both joints of free runs from estimated first states, in mrad. *True* is the simulator itself, driven by the recorded inputs.",
                f"**{len(kept)} of {len(fresh)} fresh blocks are used; on trials that nobody has seen their error is "
                f"{_times(gains)}; "
                + (f"worse with the block: {', '.join(bad)}.**" if bad else "no case is worse with what is written.**"),
                "## Shipped cases",
                _table(shipped, False),
                f"## Fresh cases, seed {seed}: {len(fresh)} of {asked} done",
                _table(fresh, True),
                "## Why blocks were shrunk or refused",
                "\n".join(f"* {row['name']}: {row['reason']}" for row in rows if row["verdict"] != "kept"),
            ]
        )
        + "\n"
    )


def _times(gains: Sequence[float]) -> str:
    if not gains:
        return "unknown"
    return f"{np.median(gains):.2f} of that without it in the median ({min(gains):.2f} to {max(gains):.2f})"


def _table(rows: Sequence[Mapping[str, Any]], unseen: bool) -> str:
    heads = ["case", "hidden", "block", "held out: without", "with", "true", "as learned, where not kept"]
    heads += ["never seen: without", "with", "true"] if unseen else []
    lines = [heads, ["---"] * len(heads)]
    for row in rows:
        names = ["without", "with_block", "true", "as_learned"]
        names += ["without_unseen", "with_unseen", "true_unseen"] if unseen else []
        lines.append([row["name"], row["hidden"], row["verdict"], *(_mrad(row[name]) for name in names)])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _mrad(value: float | None) -> str:
    return "" if value is None else f"{1e3 * value:.3g}"
