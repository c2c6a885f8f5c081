"""What the data say nothing about: sites where an effect of typical size would stay within the noise, and rest."""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from orchestrator.diagnosis.decide.thresholds import AS_ELSEWHERE, FOUND, MOST_AT_REST, MOST_UNSEEN, MOVES, SHOWN
from orchestrator.diagnosis.fit.evidence import LearningData
from orchestrator.diagnosis.linear.calibration import Stage
from orchestrator.library.cards import Candidate
from orchestrator.models.smoothing import SmoothedTrial

# These act only beyond a level; a range that was never entered says nothing against the data.
BEYOND_A_LEVEL = ("end_stop", "saturation", "dead_zone", "recruitment_curve", "backlash", "tremor")


def is_at_rest(learning: LearningData) -> bool:
    """Whether no output moves beyond its noise within any trial: such a record shows forces at rest and nothing else."""
    return all(bool(np.all(np.ptp(t.measured, axis=0) < MOVES * t.noise)) for t in learning.trials)


def driven(trials: Sequence[SmoothedTrial]) -> np.ndarray:
    """Which inputs (nu,) take different values, beyond the noise with which they are measured."""
    every = np.concatenate([t.inputs for t in trials])
    noise = trials[0].input_noise
    return np.asarray(np.ptp(every, axis=0) > MOVES * (np.zeros(every.shape[1]) if noise is None else noise))


def blind_sites(stage: Stage, candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Sites at which most effects of the library, at their typical sizes, would not be found.

    That a stated tolerance, or a clock, would hide an effect says nothing against the record.
    """
    if is_at_rest(stage.tangent.learning):
        return tuple(dict.fromkeys(c.site for c in candidates))
    powers: dict[tuple[str, str], float] = {}
    for candidate in candidates:
        if candidate.card.id not in BEYOND_A_LEVEL and "+" not in candidate.site:
            powers[candidate.site, candidate.card.id] = 0.0
    for block in stage.blocks:
        candidate = block.candidate
        if candidate.card.id in BEYOND_A_LEVEL:
            continue
        for k, name in enumerate(block.names):
            site = _site(candidate, name)
            if not name or site is None or not np.isfinite(block.sizes[k]):
                continue
            key = (site, candidate.card.id)
            powers[key] = max(powers.get(key, 0.0), float(block.powers[k] * block.sizes[k] ** 2))
    sites = dict.fromkeys(site for site, _ in powers)
    shown = {key: _is_shown(key, powers, FOUND * stage.colour.level**2) for key in powers}
    share = {site: np.mean([seen for (place, _), seen in shown.items() if place == site]) for site in sites}
    return tuple(site for site in sites if share[site] <= SHOWN)


def _is_shown(key: tuple[str, str], powers: Mapping[tuple[str, str], float], least: float) -> bool:
    """Whether an effect stands out, or fails to by the noise alone: it does as much as at the sites that are excited.

    An effect that acts at one site only, such as a tilt of the base, has but the noise to compare with.
    """
    elsewhere = [power for (site, effect), power in powers.items() if effect == key[1] and site != key[0]]
    return powers[key] > least or powers[key] > AS_ELSEWHERE * max(elsewhere, default=least) > 0.0


def unseen(candidates: Sequence[Candidate], blind: Sequence[str], resting: bool = False) -> list[Candidate]:
    """Effects to look for, one of each id: some at the first blind site, or at all of them if the machine only rested.

    Args:
        candidates: the effects and sites to choose from.
        blind: sites at which the record shows no effect.
        resting: whether no output moved.
    """
    sites = blind if resting else blind[:1]
    there = [c for c in candidates if c.site in sites and c.card.id not in BEYOND_A_LEVEL]
    return list({c.card.id: c for c in reversed(there)}.values())[::-1][: MOST_AT_REST if resting else MOST_UNSEEN]


def _site(candidate: Candidate, parameter: str) -> str | None:
    """The site of one element of an effect that acts at several: `joint2` for `b[2]`; None for what they share."""
    if "+" not in candidate.site:
        return candidate.site
    match = re.search(r"\[(\d+)\]$", parameter)
    return candidate.site.split("+")[int(match[1]) - 1] if match else None
