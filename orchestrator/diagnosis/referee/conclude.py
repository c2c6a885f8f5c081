"""From a search and its referee to a diagnosis: what is left, the verdict, the ranking, and warnings."""

from collections.abc import Sequence
from dataclasses import replace

from orchestrator.compare.result import Comparison
from orchestrator.diagnosis.decide.bayes_factor import BayesFactors
from orchestrator.diagnosis.decide.confusion import disguise, groups, least_odds, rivals
from orchestrator.diagnosis.decide.constancy import Change, changes
from orchestrator.diagnosis.decide.excitation import blind_sites, is_at_rest
from orchestrator.diagnosis.decide.thresholds import DECISIVE
from orchestrator.diagnosis.decide.verdict import Left, decide
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.linear.calibration import Stage
from orchestrator.diagnosis.linear.coverage import coverage
from orchestrator.diagnosis.linear.thresholds import NOTABLE, PRACTICAL, SIGNIFICANT
from orchestrator.diagnosis.referee.ranking import rank
from orchestrator.diagnosis.referee.referee import Refereed
from orchestrator.diagnosis.referee.thresholds import CLEAR, MOST_NOISE
from orchestrator.diagnosis.search.search import Searcher
from orchestrator.library.cards import Candidate
from orchestrator.verdicts.result import LEFT_UNTRIED, Diagnosis, HeldOut, Odds, Verdict, reducible_removed

# How likely the truth is among the sets tried, by verdict: a judgement, to be replaced by the rates of `make
# bench-diagnosis`.
TRUST: dict[Verdict, float] = {"adequate": 1.0, "cannot_tell": 1.0, "named": 0.9, "ambiguous": 0.9, "unknown": 0.1}

# How a note begins that parameters may explain an unknown effect.
SEVERAL_OFF = "several parameters of the model that are off together"


def conclude(
    nominal: Comparison,
    refereed: Refereed,
    searcher: Searcher,
    *,
    declared: bool,
    impossible: Sequence[str],
) -> Diagnosis:
    """The diagnosis without what only later steps add.

    Args:
        nominal: the model as given, compared with all trials.
        declared: whether sensors declare the noise of the outputs.
        impossible: ids of effects that the model has no place for.
    """
    trace, last = searcher.trace, refereed.steps[-1].comparison
    first = trace.stages[0]
    assert nominal.held_out is not None and last.held_out is not None
    before, after = nominal.held_out.over_floor, last.held_out.over_floor
    best = refereed.accepted[-1].refit if refereed.accepted else None
    stage = first if best is None else searcher.test_of(best)
    left = _left(first, stage, refereed, declared)
    scale = stage.colour.scale
    bayes_factors = BayesFactors(best, searcher.learning, scale)
    without = first.tangent.base.cost
    like = () if best is None else rivals(best, trace.refitted, scale, bayes_factors, without)
    blind, confusable = blind_sites(first, searcher.candidates), groups(like)
    against = {} if best is None else least_odds(best, trace.refitted, like)
    against |= dict.fromkeys(refereed.refused, DECISIVE)
    odds = tuple(Odds(r.replaced, r.by, r.odds) for r in like if r.by != r.replaced)
    # What a simpler law holds of a larger one is there, whatever excitation the rest of that needs.
    others = groups([rival for rival in like if not rival.holds_it])
    missing = () if best is None else _missing(first, best, others, searcher.candidates)
    other_law = None if best is None else disguise(best, trace.refitted, scale, trace.choices)
    changing = () if best is None or left.is_another or not declared else _changing(searcher, best, stage)
    verdict = decide(
        len(refereed.accepted),
        left,
        ambiguous=bool(confusable),
        blind=blind,
        missing=missing,
        disguised=other_law is not None or bool(changing),
    )
    named = verdict in ("named", "ambiguous")
    open_class = named or (verdict == "cannot_tell" and best is not None)
    experiments = {c.card.id: c.card.experiment for c in searcher.candidates}
    return Diagnosis(
        model=searcher.base.name,
        data=nominal.data,
        verdict=verdict,
        effects=refereed.steps[-1].effects if named else (),
        confusable=confusable if open_class else (),
        odds=odds if open_class else (),
        ranking=rank(trace, first, searcher.candidates, best, against, TRUST[verdict]),
        p_value=max(a.p_value for a in refereed.accepted) if refereed.accepted else first.p_value,
        noise_floor=nominal.noise_floor,
        held_out=HeldOut(
            nominal.held_out.rmse,
            last.held_out.rmse if named else nominal.held_out.rmse,
            nominal.noise_floor,
            reducible_removed(before, after) if named else 0.0,
        ),
        warnings=(
            *_on_the_search(impossible, blind, is_at_rest(searcher.learning), trace.was_cut),
            *_on_what_is_left(verdict, left, stage, best, other_law, changing),
            *_on_parameters(verdict, searcher.learning.nuisances.names),
            *(map(str, odds) if open_class else ()),
            *(bayes_factors.hidden({(r.replaced, r.by) for r in like}) if named else ()),
            *(missing if verdict == "cannot_tell" else ()),
        ),
        next_experiment={"effects": list(confusable[0]), "do": experiments[confusable[0][0]]}
        if open_class and confusable
        else None,
        patched_model=None,
        seconds=0.0,
        steps=refereed.steps if named else refereed.steps[:1],
        best=refereed.steps[-1].effects if verdict == "unknown" else (),
        search=replace(refereed, was_cut=trace.was_cut),
    )


def _missing(
    first: Stage, best: Refit, confusable: Sequence[Sequence[str]], candidates: Sequence[Candidate]
) -> tuple[str, ...]:
    """The excitation, in words, that members of a class need to show themselves and these data lack."""
    members = {name for group in confusable for name in group}
    sites = {c.site for c in best.effects.candidates}
    chosen = [c for c in candidates if c.card.id in members and c.site in sites]
    return tuple(c.message for c in coverage(first.tangent.response, chosen, {}) if not c.is_enough)


def _left(first: Stage, stage: Stage, refereed: Refereed, declared: bool) -> Left:
    base, best = first.tangent.base, stage.tangent.base
    rows = refereed.rows
    structured = stage.is_structured
    if best.ids:
        structured = structured or min(stage.p_value, stage.p_of_flexible) <= CLEAR
    return Left(
        (base.cost, best.cost, base.fit.rows),
        (refereed.held_out[0], refereed.held_out[-1], rows),
        min(stage.colour.level**2, MOST_NOISE) if declared else stage.colour.level**2,
        structured,
        declared,
        stage.scatter,
        best.effects.imperfect,
    )


def _changing(searcher: Searcher, best: Refit, stage: Stage) -> tuple[Change, ...]:
    """Effects that are not the same in all trials, as far as a machine's own drift would not do; noise must be declared."""
    return changes(stage.tangent, stage.colour.scale, lambda effect: searcher.without(best, effect), CLEAR, NOTABLE)


def _on_the_search(impossible: Sequence[str], blind: Sequence[str], resting: bool, was_cut: bool) -> list[str]:
    found = [reason for reason in impossible if " not tried: " in reason]  # an FMU says why
    if without_slot := [effect for effect in impossible if effect not in found]:
        found.append(f"not tried, the model has no free slot for them: {', '.join(without_slot)}")
    if resting:
        found.append("nothing moves beyond the noise of its sensor in any learning trial: record trials with motion")
    elif blind:
        found.append(f"the data would not show most effects at {', '.join(blind)}: record trials that move them")
    if was_cut:
        found.append(LEFT_UNTRIED)
    return found


def _on_parameters(verdict: str, tolerated: Sequence[str]) -> list[str]:
    """What else may explain an unknown effect: a right model whose parameters are another machine's."""
    if verdict != "unknown" or tolerated:
        return []
    return [f"{SEVERAL_OFF} are not looked for; let them be refitted: --tolerance 5%, or [tolerances]"]


def _on_what_is_left(
    verdict: str, left: Left, stage: Stage, best: Refit | None, other_law: Refit | None, changing: Sequence[Change]
) -> list[str]:
    size = (
        f"on held-out trials the error is {(left.held_out[1] / left.noise) ** 0.5:.3g} times its part without structure"
    )
    if other_law is not None and best is not None and not left.is_another:
        return [
            f"{' + '.join(best.ids)} explains the error, but {' + '.join(other_law.ids)} with"
            f" {' and '.join(other_law.pressed())} at the limit of what it can be explains it far better: a law that the library"
            " lacks"
        ]
    if changing:
        return [str(change) for change in changing]
    if verdict == "unknown" and best is not None:
        return [
            f"{' + '.join(best.ids)} explains part of the error, but {left.share:.0%} of what exceeds the noise is left"
            f" ({size}) that no effect explains"
        ]
    if best is not None and (left.exceeds or (left.structured and stage.structured_share > PRACTICAL)):
        return [f"a structured error is left: {size}"]
    if verdict == "cannot_tell" and left.shows_held_out_only:
        return [f"learning trials show nothing that held-out trials do ({size}); learn from trials like those"]
    if verdict == "adequate" and stage.p_value <= SIGNIFICANT:
        return [
            f"something is left that noise would not do (p = {stage.p_value:.3g}), but it is only"
            f" {stage.structured_share:.1%} of the error and no effect of meaningful size"
        ]
    return []
