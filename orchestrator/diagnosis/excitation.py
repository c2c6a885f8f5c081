"""What the data say nothing about: sites where an effect of typical size would stay within the noise, and rest."""

import re
from collections.abc import Sequence

import numpy as np

from orchestrator.diagnosis.calibration import Stage
from orchestrator.diagnosis.candidates import Candidate
from orchestrator.diagnosis.evidence import LearningData
from orchestrator.models.smoothing import SmoothedTrial

# Drop of the misfit, in units of the noise, by which an effect is found with near certainty among a hundred candidates.
FOUND = 36.0
# A site is blind if the data would show no more than this share of its effects. A muscle that is never used shows none;
# noise of 1e-3 rad alone hides up to half of those of a site that is well excited.
SHOWN = 0.2
# Effects of a blind site that the next experiment should show.
MOST_UNSEEN = 2
# These act only beyond a level; a range that was never entered says nothing against the data.
BEYOND_A_LEVEL = ("end_stop", "saturation", "recruitment_curve", "backlash", "tremor")

# A signal moves if it ranges over this many standard deviations of its noise in some trial; white noise does over 8.
MOVES = 12.0


def is_at_rest(learning: LearningData) -> bool:
    """Whether no output moves beyond its noise within any trial: such a record shows forces at rest and nothing else."""
    return all(bool(np.all(np.ptp(t.measured, axis=0) < MOVES * t.noise)) for t in learning.trials)


def driven(trials: Sequence[SmoothedTrial]) -> np.ndarray:
    """Which inputs (nu,) take different values, beyond the noise with which they are measured."""
    every = np.concatenate([t.inputs for t in trials])
    noise = trials[0].input_noise
    return np.asarray(np.ptp(every, axis=0) > MOVES * (np.zeros(every.shape[1]) if noise is None else noise))


def blind_sites(stage: Stage, candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Sites at which most effects of the library, at their typical sizes, would not be found in this record.

    That a stated tolerance would hide an effect says nothing against the record.
    """
    if is_at_rest(stage.tangent.learning):
        return tuple(dict.fromkeys(c.site for c in candidates))
    noise = stage.colour.level**2
    shown: dict[tuple[str, str], bool] = {}
    for candidate in candidates:
        if candidate.card.id not in BEYOND_A_LEVEL and "+" not in candidate.site:
            shown[candidate.site, candidate.card.id] = False
    for block in stage.blocks:
        candidate = block.candidate
        if candidate.card.id in BEYOND_A_LEVEL:
            continue
        for k, name in enumerate(block.names):
            if not name or not np.isfinite(block.sizes[k]):
                continue
            key = (_site(candidate, name), candidate.card.id)
            power = float(block.powers[k] * block.sizes[k] ** 2)
            shown[key] = shown.get(key, False) or power > FOUND * noise
    sites = dict.fromkeys(site for site, _ in shown)
    share = {site: np.mean([seen for (place, _), seen in shown.items() if place == site]) for site in sites}
    return tuple(site for site in sites if share[site] <= SHOWN)


def unseen(candidates: Sequence[Candidate], blind: Sequence[str]) -> list[Candidate]:
    """Effects to look for at the first blind site, one of each id."""
    there = [c for c in candidates if c.site in blind[:1] and c.card.id not in BEYOND_A_LEVEL]
    return list({c.card.id: c for c in reversed(there)}.values())[::-1][:MOST_UNSEEN]


def _site(candidate: Candidate, parameter: str) -> str:
    """The site of one element of an effect that acts at several: `joint2` for `b[2]`."""
    match = re.search(r"\[(\d+)\]$", parameter)
    if "+" not in candidate.site or match is None:
        return candidate.site
    return candidate.site.split("+")[int(match[1]) - 1]
