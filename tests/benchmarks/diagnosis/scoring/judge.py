"""One diagnosis against the truth of its case, by the rules of the project's public score."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from tests.benchmarks.diagnosis.scoring.sites import parameter_errors, same_site

# Effects that no slot of a model has, by the law of the wider library that is the same.
SAME_LAW = {
    "cubic_spring": "cubic_stiffness",
    "overflow": "overflow",
    "position_dependent_friction": "position_dependent_friction",
}
# Below this probability the diagnosis itself says that no experiment of its menu separates what is left.
HOPELESS = 0.6


def judge(name: str, truth: Mapping[str, Any], result: Mapping[str, Any]) -> dict[str, Any]:
    """What a result got right. A failed run is wrong everywhere.

    A case is right at class level when every true effect is named, or declared confusable (in groups of at most three)
    with one that is named, and no more effects are named than are true. What no slot has is right as "unknown", and by the name
    that balance equations have for it.
    """
    verdict = result.get("verdict", "failed")
    true = [] if truth["effects"] == ["none"] else list(truth["effects"])
    effects = result.get("effects") or [] if verdict in ("named", "ambiguous") else []
    said = [effect["id"] for effect in effects]
    if true == ["unknown"] and said == [SAME_LAW.get(truth["kind"])]:
        true = said
    wide = set(said)
    for group in result.get("confusable") or []:
        if len(group) <= 3 and set(group) & set(said):
            wide |= set(group)
    ranking = [sorted(entry["effects"]) for entry in result.get("ranking") or []]
    exact = sorted(said) == sorted(true)
    places = exact and all(
        any(e["id"] == i and same_site(s, e["site"], truth["model"]) for e in effects)
        for i, s in zip(true, truth["sites"], strict=True)
    )
    top = (result.get("ranking") or [{}])[0]
    return {
        "case": name,
        "family": truth["family"],
        "model": truth["model"],
        "noise": truth["noise_level"],
        "enr": min(truth["enr_each"], default=0.0),
        "enr_left": truth["enr_left"],
        "wanted_enr": truth["wanted_enr"],
        "record_seconds": truth["record_seconds"],
        "true": sorted(true),
        "kind": truth["kind"],
        "verdict": verdict,
        "said": sorted(said),
        "exact": exact,
        "exact_site": places,
        "class": len(said) == len(true) and set(true) <= wide,
        "superset": set(true) <= set(said),
        "jaccard": len(set(true) & set(said)) / max(len(set(true) | set(said)), 1),
        "class_size": 1 + len(wide) - len(set(said)),
        "extra": len(set(said) - set(true)),
        "top3": sorted(true) in ranking[:3],
        # A run that failed says nothing about its library, and must not drop out of a share for that.
        "offered": verdict == "failed" or set(true) <= {effect for entry in ranking for effect in entry},
        "advised": result.get("next_experiment") is not None,
        "separable": (result.get("next_experiment") or {}).get("probability_to_separate", 1.0) >= HOPELESS,
        "parameters": _parameters(truth, effects, exact and truth["effects"] != ["unknown"]),
        "probability": top.get("probability"),
        "probability_right": sorted(top.get("effects") or []) == sorted(true),
        **_held_out(truth, result.get("held_out") or {}),
        "wall_seconds": result.get("wall_seconds"),
        "cpu_seconds": result.get("cpu_seconds"),
        "peak_mb": result.get("peak_mb"),
        "failed": result.get("failed", ""),
    }


def judge_again(truth: Mapping[str, Any], first: Mapping[str, Any], again: Mapping[str, Any] | None) -> dict[str, Any]:
    """What the recommended experiment made of an answer that left something open.

    `open`: the first answer was a class of effects or "cannot tell". `resolved`: with the record of one recommended
    experiment the answer is the truth, named, or "adequate" where nothing is missing, or "unknown" where no library has it.
    """
    left_open = first["verdict"] in ("ambiguous", "cannot_tell")
    if again is None or not left_open:
        return {"open": left_open, "again": None, "resolved": False, "again_cpu_seconds": 0.0}
    row = judge(first["case"], truth, again)
    without_names = {(): "adequate", ("unknown",): "unknown"}
    wanted = without_names.get(tuple(row["true"]), "named")
    right = row["verdict"] == wanted and (row["exact"] or wanted != "named")
    return {
        "open": True,
        "again": row["verdict"],
        "again_said": row["said"],
        "resolved": bool(right),
        "again_cpu_seconds": row["cpu_seconds"] or 0.0,
    }


def _parameters(truth: Mapping[str, Any], effects: list[Any], exact: bool) -> list[tuple[float, bool]]:
    if not exact:
        return []
    found = []
    for entry in truth["parameters"]:
        found += parameter_errors(entry, next(e for e in effects if e["id"] == entry["effect"])["parameters"])
    return found


def _held_out(truth: Mapping[str, Any], held_out: Mapping[str, Any]) -> dict[str, float | None]:
    """Held-out errors over the noise: the share of the reducible one removed, and after / true model's own."""
    own, noise = truth["true_model_rmse_heldout"], truth["noise"]
    before, after = (held_out.get(key) for key in ("rmse_before", "rmse_after"))
    if not before or not after or before.keys() != own.keys():
        return {"removed": None, "over_true": None, "worse": None}
    e0, e1, best = (
        float(np.sqrt(np.mean([(part[name] / noise[name]) ** 2 for name in own]))) for part in (before, after, own)
    )
    return {
        "removed": (e0 - e1) / (e0 - best) if e0 > 1.2 * best else None,
        "over_true": e1 / best,
        "worse": e1 > 1.02 * e0,
    }
