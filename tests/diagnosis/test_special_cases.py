"""A law whose own fit went astray is tried again from what a larger law, which holds it, has found."""

import numpy as np

from fmus.catalogue import find_modelica_model
from orchestrator.diagnosis.fit.candidates import EffectSet
from orchestrator.diagnosis.fit.evidence import LearningData, refit
from orchestrator.diagnosis.fit.extensible import find_candidates, model_of
from orchestrator.diagnosis.search.search import Searcher
from orchestrator.library.cards import effect_library
from orchestrator.models.patch import free_slots
from orchestrator.models.smoothing import SmoothedTrial

DRIVE = find_modelica_model("drive")
TIME, NOISE, FRICTION = np.arange(0, 6, 0.01), np.array([1e-4]), 0.012


def test_dry_friction_whose_fit_went_astray_begins_anew_where_stribeck_friction_has_it() -> None:
    system = DRIVE.compile()
    cards = [c for c in effect_library() if c.id in ("coulomb_friction", "stribeck_friction")]
    candidates, _ = find_candidates(DRIVE, system, cards)
    dry, stribeck = (
        EffectSet(DRIVE, [c for c in candidates if c.card.id == name], ["phi"])
        for name in ("coulomb_friction", "stribeck_friction")
    )
    inputs = np.column_stack([0.05 * np.sin(2 * np.pi * 0.4 * TIME), np.zeros(len(TIME))])
    true = dry.model.compiled.with_values([FRICTION])
    read = dry.model.compiled.run(TIME, inputs, true, np.zeros(2), substeps=8).outputs
    measured = read + NOISE * np.random.default_rng(6).standard_normal(read.shape)
    data = LearningData((SmoothedTrial(TIME, inputs, measured, NOISE),), NOISE)
    searcher = Searcher(
        DRIVE, model_of(DRIVE, system, ["phi"]), free_slots(system), candidates, data, 1, lambda message: None
    )
    searcher.run()
    found = refit(stribeck, data, np.array([FRICTION, 1e-4, 0.1]))
    astray = refit(dry, data, np.array([0.05]), tolerance=1e3)
    searcher.trace.refitted = [found, astray]

    searcher.try_collinear(found)

    again = min((r for r in searcher.trace.refitted if r.ids == ("coulomb_friction",)), key=lambda r: r.fit.misfit)
    assert astray.fit.misfit > 2 * found.fit.misfit
    assert again.cost < 1.0 + 5 * (2 / again.fit.rows) ** 0.5
    np.testing.assert_allclose(again.values, FRICTION, atol=5 * again.std[0])
