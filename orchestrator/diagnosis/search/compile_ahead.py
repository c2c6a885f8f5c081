"""Compile a model with each effect in it before a search asks for them one by one."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from fmus.catalogue import ModelicaModel
from fmus.errors import MisfitError
from fmus.frontend.together import compile_together
from orchestrator.diagnosis.fit.candidates import EffectSet, as_fmu
from orchestrator.library.candidate import Candidate


def compile_ahead(base: ModelicaModel, candidates: Sequence[Candidate], processes: int) -> None:
    """Compile what the cache lacks of a model with one effect; what cannot be compiled shows when it is needed.

    Elements of one effect share a class, variants of it may have another.
    """
    if as_fmu(base) is not None:
        return
    missing = list[tuple[str, Path]]()
    for candidate in {(c.slot, c.card.class_name): c for c in candidates}.values():
        with suppress(MisfitError):
            model = EffectSet(base, [candidate], ()).written
            if model.file is not None and not model.is_compiled:
                missing.append((model.class_name, model.file))
    compile_together(missing, processes)
