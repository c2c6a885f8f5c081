"""The main steps as plain functions: each takes a model or its name, and data or their path."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator.api.model import WORKERS, as_model, chosen_cards

if TYPE_CHECKING:
    from orchestrator.compare.result import Comparison
    from orchestrator.verdicts.result import Diagnosis


def compare(model: Any, data: Any, *, workers: int = WORKERS) -> "Comparison":
    """Compare a model with measurements; the same as `misfit.Model(model).compare(data)`.

    Args:
        model: `misfit.Model`, or the name or path of one.
        data: `misfit.Data`, a path, a mapping of arrays or a data frame.
        workers: trials that run at a time.

    Raises:
        MisfitError: if an argument is none of these, or data and model do not fit.
        ComponentError: if the model fails while it runs.
    """
    return as_model(model).compare(data, workers=workers)


def diagnose(
    model: Any,
    data: Any,
    *,
    only: Sequence[str] | None = None,
    tolerances: Mapping[str, float] | None = None,
    cards: Sequence[str | Path] = (),
    workers: int = WORKERS,
    laws: bool | None = None,
) -> "Diagnosis":
    """Name what a model lacks; the same as `misfit.Model(model).diagnose(data)`.

    Args:
        model: `misfit.Model`, or the name or path of one.
        data: `misfit.Data`, a path, a mapping of arrays or a data frame.
        only: ids of the effects to look for; the whole library without it.
        tolerances: relative standard deviations of the model's parameters.
        cards: folders with effect cards of your own.
        workers: fits that run at a time; the result does not depend on it.
        laws: whether to look for a formula where no card fits; by default where the answer leaves something open.

    Raises:
        MisfitError: if an argument is none of these, or data and model do not fit.
        ComponentError: if the model fails while it runs.
    """
    found = as_model(model)
    return found.diagnose(data, only=only, tolerances=tolerances, cards=cards, workers=workers, laws=laws)


def effects(cards: Sequence[str | Path] = ()) -> tuple[str, ...]:
    """Ids of the effects that a diagnosis looks for.

    Args:
        cards: folders with effect cards of your own.
    """
    return tuple(dict.fromkeys(card.id for card in chosen_cards(None, cards)))


def models() -> tuple[str, ...]:
    """Names of the built-in models."""
    from fmus.catalogue import built_in_models

    return tuple(built_in_models())
