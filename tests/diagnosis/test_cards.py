"""Every card of the library, on the arm or else a plant: it attaches, compiles, and its values arrive in the written class."""

from pathlib import Path

import numpy as np
import pytest

from fmus.catalogue import ModelicaModel, find_modelica_model
from fmus.errors import MisfitError
from orchestrator.diagnosis.fit.candidates import EffectSet, can_join
from orchestrator.diagnosis.fit.extensible import find_candidates
from orchestrator.library.cards import EffectCard, effect_library, read_card
from orchestrator.models.patch import free_slots, patched_model

CARDS = effect_library()
ARM = find_modelica_model("arm")
PLANTS = [find_modelica_model(name) for name in ("drive", "two-mass", "linear-drive", "tanks")]


def host_of(card: EffectCard) -> ModelicaModel:
    """The first model that can hold the card."""
    return next(model for model in (ARM, *PLANTS) if find_candidates(model, model.compile(), [card])[0])


@pytest.mark.parametrize("card", CARDS, ids=lambda card: f"{card.id}{card.variant}")
def test_card_attaches_to_a_model_and_its_values_arrive_in_modelica(card: EffectCard) -> None:
    host = host_of(card)
    candidates, impossible = find_candidates(host, host.compile(), [card])
    assert candidates
    assert not impossible
    effects = EffectSet(host, [candidates[-1]], host.compile().outputs)
    low, high = effects.bounds()
    assert np.all(low < high)
    values = np.clip(1.3 * effects.first_guess() + 0.01, low, high)

    written = patched_model(host, "Written", effects.attachments(values)).compile()

    arrived = {v.name: v.start for v in written.parameters}
    np.testing.assert_allclose([arrived[v.name] for v in effects.variables], values, rtol=1e-12)
    assert written.settings[f"{candidates[-1].slot}.present"] is True


@pytest.mark.parametrize("card", CARDS, ids=lambda card: f"{card.id}{card.variant}")
def test_absent_values_leave_the_model_as_it_was(card: EffectCard) -> None:
    """At the card's `absent` values the right-hand side is the nominal one, where such values are finite and inside."""
    host = host_of(card)
    nominal = host.compile()
    candidates, _ = find_candidates(host, nominal, [card])
    effects = EffectSet(host, [candidates[0]], nominal.outputs)
    absent = np.array([parameter.absent for parameter in effects.card_parameters])
    low, high = effects.bounds()
    system = effects.model.system
    more_states = len(system.states) > len(nominal.states)
    if np.any(absent < low) or np.any(absent > high) or more_states or card.id == "recruitment_curve":
        pytest.skip("the effect vanishes only in a limit")
    x, u = [0.7, 1.2, 0.4, -0.6], [0.3, 0.2, 0.4, 0.1, 0.5, 0.25, 1.5, -2.0, 0.0, 0.0]
    x, u = x[: len(nominal.states)], u[: len(nominal.inputs)]
    if host.name == "tanks":  # flows in m3/s
        u = [1e-4, 0.0, 0.0, 0.0]
    delayed = u[: system.n_delays]

    with_effect = system.rhs(0, x, u, delayed, effects.model.compiled.with_values(absent))[0]

    plain = nominal.rhs(0, x, u, [], [v.start for v in nominal.parameters])[0]
    np.testing.assert_allclose(with_effect.full(), plain.full(), rtol=1e-10)


def test_effects_of_one_contract_share_the_arm_until_its_slots_are_full() -> None:
    system = ARM.compile()
    wanted = ["viscous_friction", "coulomb_friction", "passive_stiffness", "cogging"]
    cards = {card.id: card for card in CARDS if not card.variant}
    chosen = []
    for name in wanted:
        (candidate,), _ = find_candidates(ARM, system, [cards[name]])
        placed = can_join(chosen, candidate, free_slots(system))
        if placed is not None:
            chosen.append(placed)

    assert [c.card.id for c in chosen] == wanted[:3]
    assert len({c.slot for c in chosen}) == 3


def test_two_weak_muscles_live_in_one_slot() -> None:
    system = ARM.compile()
    card = next(card for card in CARDS if card.id == "muscle_weakness")
    candidates, _ = find_candidates(ARM, system, [card])

    second = can_join(candidates[:1], candidates[4], free_slots(system))

    assert second is not None
    assert second.slot == candidates[0].slot
    assert can_join(candidates[:1], candidates[0], free_slots(system)) is None
    assert can_join([candidates[0], second], second, free_slots(system)) is None


def test_a_joint_may_have_a_stop_at_each_end() -> None:
    system = ARM.compile()
    stops = [card for card in CARDS if card.id == "end_stop"]
    candidates, _ = find_candidates(ARM, system, stops)
    above, below = (next(c for c in candidates if c.card.variant == variant) for variant in ("above", "below"))

    second = can_join([above], below, free_slots(system))

    assert second is not None
    assert (second.card.variant, second.site) == ("below", above.site)
    assert second.slot != above.slot


def test_card_that_lacks_an_entry_is_refused_by_name(tmp_path: Path) -> None:
    broken = tmp_path / "broken.toml"
    broken.write_text('id = "x"\n')

    with pytest.raises(MisfitError, match=r"broken\.toml: lacks 'title'"):
        read_card(broken)
