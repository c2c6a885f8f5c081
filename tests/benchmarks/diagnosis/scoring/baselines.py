"""Baselines by the same rules as the diagnosis, as far as they apply to a bare list of names."""

from collections.abc import Mapping, Sequence
from typing import Any

from tests.benchmarks.diagnosis.scoring.summary import singles
from tests.benchmarks.diagnosis.scoring.utility import utility
from tests.benchmarks.diagnosis.scoring.wilson import Share

COLUMNS = (
    "false alarm (N0, N1, N2)",
    "single: name",
    "single: in top 3",
    "pair: names",
    "pair: both in",
    "too many",
    "usefulness",
)


def as_rows(
    rows: Sequence[Mapping[str, Any]], named: Mapping[str, Mapping[str, Any]], method: str
) -> list[dict[str, Any]]:
    """Rows as if a method had been the diagnosis."""
    found = []
    for row in rows:
        result = named.get(row["case"], {}).get(method)
        if result is None:
            continue
        said = sorted(result["effects"])
        found.append(
            {
                **row,
                "verdict": "named" if said else "adequate",
                "class_size": 1,
                "said": said,
                "exact": said == row["true"],
                "class": said == row["true"],
                "superset": set(row["true"]) <= set(said),
                "top3": len(row["true"]) == 1 and row["true"][0] in result["ranking"][:3],
                "extra": len(set(said) - set(row["true"])),
            }
        )
    return found


def method_scores(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """One cell for each of `COLUMNS`."""
    plain = [r for r in rows if r["wanted_enr"] is None]
    nothing = [r for r in plain if r["family"] in ("N0", "N1", "N2")]
    single = singles(rows)
    pair = [r for r in plain if r["family"] == "D"]
    extra = [r["extra"] for r in single + pair if r["said"]]
    return [
        str(Share.of(bool(r["said"]) for r in nothing)),
        str(Share.of(r["exact"] for r in single)),
        str(Share.of(r["top3"] for r in single)),
        str(Share.of(r["exact"] for r in pair)),
        str(Share.of(r["superset"] for r in pair)),
        f"{sum(extra) / len(extra):.2f} (n = {len(extra)})" if extra else "-",
        f"{sum(map(utility, rows)) / len(rows):.2f} (n = {len(rows)})" if rows else "-",
    ]
