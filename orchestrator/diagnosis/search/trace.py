"""What a search has tried: screened, refitted and failed sets, and why a set was not taken."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from orchestrator.diagnosis.decide.confusion import half_bic
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.fit.thresholds import NEAR_FLOOR
from orchestrator.diagnosis.linear.calibration import Stage
from orchestrator.diagnosis.linear.input_noise import explained_by_noise
from orchestrator.diagnosis.linear.thresholds import NOTABLE, PRACTICAL, SCATTER, SIGNIFICANT
from orchestrator.diagnosis.search.screening import Screened
from orchestrator.diagnosis.search.thresholds import VISIBLE, WORTHWHILE
from orchestrator.library.cards import Candidate


@dataclass(frozen=True)
class Accepted:
    """A set on the path, with the chance that noise alone would have made its last effect look so good."""

    refit: Refit
    p_value: float


@dataclass
class Trace:
    """Everything that was tried: screened sets, refitted sets, and the test of each set that was extended.

    `choices` is the number of candidates that sets were chosen from. `failed` says of sets that could not be built,
    simulated or fitted, why. `operations` are those of the runs of each fit; `was_cut`: they were so many that the search ended
    before it found nothing better.
    """

    choices: int = 1
    screened: list[Screened] = field(default_factory=list)
    refitted: list[Refit] = field(default_factory=list)
    stages: list[Stage] = field(default_factory=list)
    failed: dict[tuple[Candidate, ...], str] = field(default_factory=dict)
    operations: list[float] = field(default_factory=list)
    was_cut: bool = False

    def fail(self, chosen: Sequence[Candidate], error: Exception) -> None:
        """Keep the reason why candidates could not be tried together."""
        self.failed[tuple(chosen)] = str(error)

    def half_bic(self, found: Refit) -> float:
        """Half the extended BIC of a set, in units of the least noise that any of the tested sets leaves."""
        return half_bic(found, min(stage.colour.scale for stage in self.stages), self.choices)

    def tested_on(self, found: Refit) -> Stage:
        """The test of the largest set that a set contains."""
        inside = [s for s in self.stages if s.tangent.base.labels < found.labels]
        return max(inside, key=lambda s: len(s.tangent.base.ids))

    def p_value(self, found: Refit) -> float:
        """Chance that noise alone would make what a set adds to the tested set inside it look so good."""
        stage = self.tested_on(found)
        before = stage.tangent.base
        return stage.p_of_fit(found.fit.misfit, max(found.size - before.size, 1), len(found.ids) - len(before.ids))

    def _charge(self, found: Refit) -> float:
        """What a set pays in its half BIC beside its misfit."""
        return half_bic(found, 1.0, self.choices) - 0.5 * found.fit.misfit

    def objection(self, found: Refit) -> str:
        """What speaks against a set that fits best: that it is another law in disguise, that noise would do as well, or
        that it is too small to matter."""
        if pressed := found.pressed():
            return f"fits best with {' and '.join(pressed)} at the limit of what it can be, or unknown with all sizes: another law in disguise"
        p = self.p_value(found)
        if p > SIGNIFICANT:
            return f"noise alone would do as well (p = {p:.2g})"
        stage = self.tested_on(found)
        before = stage.tangent.base
        noise = stage.colour.level**2
        if explained_by_noise(stage.tangent, found, noise, self._charge(found) - self._charge(before)):
            return "lowers the error by the noise of the inputs that it cuts off, not along inputs without that"
        # What noise leaves has a mean square that scatters; where little exceeds it, nobody knows a share of that.
        scatter = SCATTER * noise * (2.0 / before.fit.rows) ** 0.5
        reducible = max(before.cost - min(noise, 1.0) - scatter, 1e-9)
        if before.cost - found.cost < WORTHWHILE * reducible:
            return f"takes less than {WORTHWHILE:.0%} of what exceeds the noise"
        does = max(before.cost - found.cost, 0.0) ** 0.5
        explicable = max(stage.nominal_rms**2 - noise, 0.0) ** 0.5
        falls = before.cost**0.5 - found.cost**0.5 > PRACTICAL * stage.nominal_rms
        # Where much is left, what lowers the error by less may imitate a part of that.
        clean = found.cost < NEAR_FLOOR**2 * max(noise, 1.0)
        if found.is_meaningful() or falls:
            return ""
        if clean and does >= NOTABLE * noise**0.5 and does > min(PRACTICAL * explicable, VISIBLE * noise**0.5):
            return ""
        return "" if clean and self._shows(found, stage) else "is of a size that does not matter"

    def _shows(self, found: Refit, stage: Stage) -> bool:
        """Whether what a set adds to the tested one shows in the outputs beside the noise, and beside all that was missing."""
        first, change = self.stages[0].tangent, stage.tangent.change_to(found)
        return stage.is_notable(change) and stage.tangent.over_noise(change) > PRACTICAL * first.over_noise(first.error)
