"""Where a search turns to once the path of the likeliest sets has ended far from noise."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from orchestrator.diagnosis.decide.confusion import half_bic
from orchestrator.diagnosis.decide.thresholds import LEFT
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.fit.thresholds import NEAR_FLOOR
from orchestrator.diagnosis.linear.thresholds import MOST_EFFECTS
from orchestrator.library.cards import Candidate


@dataclass(frozen=True)
class OtherPath:
    """A set from which another path leads on, without the effect that is another law in disguise, if one is."""

    refit: Refit
    in_disguise: Candidate | None = None


def leaves_another(first: Refit, last: Refit, noise: float) -> bool:
    """Whether the last set of a path leaves more than noise, and more than the imperfection of a right set.

    Elastic tendons, whose card is imperfect, leave 15 noises of 8700: other paths would be followed for minutes. A set
    that can grow no more is likelier to have grown along a wrong path than to be right three times and imperfect.

    Args:
        first: the model as given.
        noise: power of the noise in the metric.
    """
    noise = max(noise, 1.0)
    much = last.cost - noise > max(LEFT, last.effects.imperfect) ** 2 * (first.cost - noise)
    return last.cost > NEAR_FLOOR * noise and (much or len(last.ids) == MOST_EFFECTS)


def other_path(
    base: Refit, tried: Sequence[Refit], tested: Collection[frozenset[str]], noise: float, choices: int
) -> OtherPath | None:
    """The likeliest set that was not extended yet, `tested` being the labels of those that were.

    An effect that fits best as long as others are missing may imitate them. One that fits better than the last set, `base`,
    at the limit of what it can be imitates another law: what is beside it comes first.
    """

    def cost(found: Refit) -> float:
        return half_bic(found, noise, choices)

    present = sorted((r for r in tried if r.is_present()), key=cost)
    for found in present:
        effect = found.pressed_effect()
        if effect is not None and cost(found) < cost(base) and found.labels - {effect.label} not in (*tested, set()):
            return OtherPath(found, effect)
    able = (r for r in present if not r.pressed() and len(r.ids) < MOST_EFFECTS and r.labels not in tested)
    return next(map(OtherPath, able), None)
