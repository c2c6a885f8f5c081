"""Effects compose: any subset on any sites vanishes together, acts one by one, and torques of slots add up."""

import re
from dataclasses import dataclass
from functools import cache
from itertools import combinations

import numpy as np
import pytest

from fmus.catalogue import find_modelica_model
from fmus.symbolic.system import SymbolicSystem
from orchestrator.library.cards import EffectCard, effect_library
from orchestrator.models.patch import Attachment, check_attached, free_slots, patched_model

ARM = find_modelica_model("arm")
CARDS = {card.card_file.stem: card for card in effect_library() if card.card_file is not None}
# Drawn once, so that every card is in a subset; these two vanish only in a limit that has no numbers.
IN_A_LIMIT = {"recruitment_curve_sigmoid", "series_elasticity"}
SUBSETS = [
    ("gravity_tilt", "end_stop_below", "stimulation_crosstalk", "force_sensor_offset", "force_sensor_gain", "tremor"),
    ("muscle_weakness", "rotor_inertia", "viscous_friction", "stretch_reflex", "moment_arm_error", "stribeck_friction"),
    ("passive_stiffness", "sensor_lag", "activation_dynamics", "fatigue"),
    ("payload", "stimulation_delay", "recruitment_curve"),
    ("joint_offset", "coulomb_friction", "quadratic_drag"),
    ("constant_force", "cogging", "quadratic_drag_joint", "constant_force_joint"),
    ("saturation", "joint_scale", "end_stop_above", "hysteresis", "joint_offset"),
    ("viscous_friction", "force_sensor_offset", "payload", "joint_offset", "end_stop_below", "stretch_reflex"),
]
TORQUES = [
    ("viscous_friction", "rotor_inertia", "end_stop_above"),
    ("coulomb_friction", "hysteresis", "cogging"),
    ("stribeck_friction", "tremor", "passive_stiffness"),
]
PAIRS = [(names, pair) for names in TORQUES for pair in combinations(names, 2)]
LINKAGE = ("linkage.q[1]", "linkage.q[2]", "linkage.w[1]", "linkage.w[2]")


@dataclass(frozen=True)
class Composed:
    """The arm with effects: its system, and the slot of each effect by the name of its card."""

    system: SymbolicSystem
    slots: dict[str, str]

    def elements(self, name: str, parameter: str) -> list[int]:
        """Places of a parameter of an effect, or of its elements, in the parameter vector."""
        pattern = re.compile(rf"{self.slots[name]}\.{parameter}(\[.*\])?")
        found = [i for i, v in enumerate(self.system.parameters) if pattern.fullmatch(v.name)]
        assert found, f"{name} has no parameter {parameter}"
        return found

    def absent(self) -> np.ndarray:
        """Parameters with all strengths at the cards' absent values, or at the declared bound beside them."""
        values = np.array([v.start for v in self.system.parameters], dtype=float)
        for name in self.slots:
            for parameter in CARDS[name].parameters:
                if np.isfinite(parameter.meaningful):
                    for i in self.elements(name, parameter.name):
                        declared = self.system.parameters[i]
                        low = -np.inf if declared.minimum is None else declared.minimum
                        high = np.inf if declared.maximum is None else declared.maximum
                        values[i] = np.clip(parameter.absent, low, high)
        return values

    def states(self, linkage: np.ndarray, u: np.ndarray, random: np.random.Generator, on: str = "") -> np.ndarray:
        """The linkage's states, and those of effects: where a lag has settled, except for the effect that is `on`."""
        settled = {"r": linkage[:2], "a": u[:6], "capacity": np.ones(6)}
        found = list(linkage)
        for state in self.system.states[4:]:
            slot, name, index = re.fullmatch(r"(\w+)\.(\w+)\[(\d+)\]", state.name).groups()  # type: ignore[union-attr]
            own = slot == self.slots.get(on) or name not in settled
            found.append(random.uniform(0.1, 0.9) if own else settled[name][int(index) - 1])
        return np.array(found)

    def answer(self, x: np.ndarray, u: np.ndarray, p: np.ndarray, late: np.ndarray | None = None) -> np.ndarray:
        """Derivatives of the linkage's states and readings of the encoders; delayed commands are as they are now."""
        delayed = self.system.history(0, u, p)[0] if late is None else late[: self.system.n_delays]
        dx, z = self.system.rhs(0, x, u, delayed, p)
        names = [v.name for v in self.system.algebraics]
        rows = [names.index(name) for name in ("q1", "q2")]
        return np.concatenate([dx.full().ravel()[:4], z.full().ravel()[rows]])


@cache
def composed(names: tuple[str, ...]) -> Composed:
    """The arm with the effects of some cards, each in the first of its slots that is free."""
    free = list(free_slots(ARM.compile()))
    slots: dict[str, str] = {}
    for name in names:
        slots[name] = next(slot for slot in CARDS[name].slots if slot in free)
        free.remove(slots[name])
    parts = [Attachment(slot, CARDS[name].class_name, {}) for name, slot in slots.items()]
    system = patched_model(ARM, "Composed", parts).compile()
    check_attached(system, parts)
    assert tuple(v.name for v in system.states[:4]) == LINKAGE
    return Composed(system, slots)


def points(random: np.random.Generator, n: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Random states of the linkage, and inputs without the corrections."""
    return [
        (
            random.uniform([0, 0.3, -3, -3], [1.6, 2.3, 3, 3]),
            np.concatenate([random.uniform(0, 1, 6), random.uniform(-10, 10, 2), [0, 0]]),
        )
        for _ in range(n)
    ]


def test_every_card_of_the_arm_is_in_a_subset_or_vanishes_only_in_a_limit() -> None:
    slots = set(free_slots(ARM.compile()))
    fitting = {name for name, card in CARDS.items() if slots & set(card.slots)}

    assert {name for subset in SUBSETS for name in subset} == fitting - IN_A_LIMIT


@pytest.mark.parametrize("names", SUBSETS, ids="+".join)
def test_effects_at_their_absent_values_leave_the_plain_arm(names: tuple[str, ...]) -> None:
    random = np.random.default_rng(5)
    plain, arm = composed(()), composed(names)
    p = arm.absent()
    for linkage, u in points(random, 10):
        expected = plain.answer(linkage, u, plain.absent())

        found = arm.answer(arm.states(linkage, u, random), u, p)

        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("names", SUBSETS, ids="+".join)
def test_each_effect_of_a_subset_acts_while_the_others_are_absent(names: tuple[str, ...]) -> None:
    random = np.random.default_rng(6)
    plain, arm = composed(()), composed(names)
    for name in names:
        p = arm.absent()
        for parameter in CARDS[name].parameters:
            p[arm.elements(name, parameter.name)] = parameter.start
        late = random.uniform(0, 1, 6) if name == "stimulation_delay" else None

        changes = [
            arm.answer(arm.states(linkage, u, random, on=name), u, p, late) - plain.answer(linkage, u, plain.absent())
            for linkage, u in points(random, 10)
        ]

        assert np.abs(changes).max() > 1e-4, name


def torque(name: str, p: dict[str, np.ndarray], x: dict[str, np.ndarray], a: np.ndarray) -> np.ndarray:
    """The law of a torque effect at two joints, N.m, from its parameters, states q, w and its own, and accelerations."""
    q, w = x["q"], x["w"]
    match name:
        case "viscous_friction":
            return -p["b"] * w
        case "rotor_inertia":
            return -p["J"] * a
        case "end_stop_above":
            return -p["k"] * np.maximum(0, q - p["qStop"])
        case "coulomb_friction":
            return -p["tauC"] * np.tanh(w / 0.002)
        case "stribeck_friction":
            return -(p["tauC"] + p["tauExtra"] * np.exp(-((w / p["vS"]) ** 2))) * np.tanh(w / 0.002)
        case "hysteresis":
            return -p["H"] * x["z"]
        case "cogging":
            return p["sine"] * np.sin(p["periods"] * q) + p["cosine"] * np.cos(p["periods"] * q)
        case "tremor":
            return p["amplitude"] * x["phase"][0] / np.hypot(*x["phase"])
    assert name == "passive_stiffness"
    return p["tau0"] - p["k"] * q


def strengths(card: EffectCard) -> list[str]:
    return [parameter.name for parameter in card.parameters if np.isfinite(parameter.meaningful)]


@pytest.mark.parametrize(("names", "pair"), PAIRS, ids=lambda names: "+".join(names))
def test_a_pair_of_torque_effects_is_the_plain_arm_with_the_sum_of_both_torques(
    names: tuple[str, ...], pair: tuple[str, str]
) -> None:
    random = np.random.default_rng(7)
    plain, arm = composed(()), composed(names)
    for linkage, u in points(random, 10):
        p = arm.absent()
        for name in pair:
            for parameter in strengths(CARDS[name]):
                places = arm.elements(name, parameter)
                p[places] = random.uniform(0.2, 1.5, len(places))
        x = arm.states(linkage, u, random)
        found = arm.answer(x, u, p)
        total = np.zeros(2)
        for name in pair:
            values = {parameter.name: p[arm.elements(name, parameter.name)] for parameter in CARDS[name].parameters}
            own = {"q": linkage[:2], "w": linkage[2:]}
            for state in ("z", "phase"):
                rows = [i for i, v in enumerate(arm.system.states) if v.name.startswith(f"{arm.slots[name]}.{state}[")]
                own[state] = x[rows]
            total += torque(name, values, own, found[2:4])
        assert np.abs(total).max() > 1e-3

        expected = plain.answer(linkage, np.concatenate([u[:8], total]), plain.absent())

        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())
