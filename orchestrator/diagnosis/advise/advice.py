"""What to do next where a diagnosis leaves explanations open."""

from dataclasses import replace

from orchestrator.diagnosis.advise.next_experiment import plan
from orchestrator.diagnosis.advise.remaining import remaining
from orchestrator.diagnosis.decide.excitation import blind_sites, is_at_rest, unseen
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import Refit
from orchestrator.diagnosis.fit.extensible import extensible
from orchestrator.diagnosis.search.search import Searcher
from orchestrator.verdicts.result import Diagnosis


def with_next_experiment(found: Diagnosis, searcher: Searcher, best: Refit | None, scale: float) -> Diagnosis:
    """Add the experiment that tells the remaining explanations apart, if there are some.

    Args:
        best: the set that held-out trials confirmed last.
        scale: power of the noise in the metric.
    """
    if not found.confusable and found.verdict != "cannot_tell":
        return found
    searcher.progress("choosing the next experiment")
    trace, learning, nominal = searcher.trace, searcher.learning, searcher.nominal
    blind = blind_sites(trace.stages[0], searcher.candidates)
    at_rest = is_at_rest(learning) and not extensible(searcher.base).runs_are_slow
    hidden = unseen(searcher.candidates, blind, at_rest)
    effects = [EffectSet(searcher.base, [candidate], nominal.signals) for candidate in hidden]
    chosen = plan(remaining(best, trace.refitted, found.confusable, nominal, learning, effects), learning, scale)
    if chosen is None:
        return found
    card_says = {"card_says": found.next_experiment["do"]} if found.next_experiment else {}
    return replace(found, next_experiment={**chosen.to_json(), **card_says}, experiment_csv=chosen.csv())
