"""Inputs that act late or not at all, friction with position and load, changes at a moment: found where nothing common explains
the record, with their values. The records come from an integrator of their own."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from plants import CASE, SLIDE, diagnosed

from fmus.catalogue import find_modelica_model
from orchestrator.greybox.candidates import fits
from orchestrator.greybox.effects import with_effects
from orchestrator.greybox.laws import laws
from orchestrator.greybox.places import Place
from orchestrator.verdicts.result import Estimate, NamedEffect

STEP, PARTS, SAMPLES = 0.01, 20, 350
TIME = np.arange(SAMPLES * PARTS) * STEP / PARTS
Act = Callable[[np.ndarray], np.ndarray]
Extra = Callable[[float, float, float, float], float]


def _as_given(force: np.ndarray) -> np.ndarray:
    return force


def _nothing(t: float, x: float, v: float, force: float) -> float:
    return 0.0


def record(folder: Path, act: Act = _as_given, extra: Extra = _nothing) -> Path:
    """Three records of the slide; what acts is `act` of the force, and a further force of time, position, speed and force."""
    random = np.random.default_rng(3)
    (folder / "Slide.mo").write_text(SLIDE)
    (folder / "case.toml").write_text(CASE)
    for trial in (1, 2, 3):
        waves = zip(random.uniform(0.2, 3.0, 4), random.uniform(0.0, 6.28, 4), strict=True)
        force = sum(3.0 * np.sin(2 * np.pi * f * TIME[::PARTS] + p) for f, p in waves)
        acting = act(np.interp(TIME, TIME[::PARTS], force))
        x = v = 0.0
        shown = []
        for k, pushed in enumerate(acting):
            if k % PARTS == 0:
                shown.append(x)
            v += STEP / PARTS * (pushed - 30.0 * x + extra(TIME[k], x, v, pushed)) / 2.0
            x += STEP / PARTS * v
        rows = np.column_stack([TIME[::PARTS], force, np.array(shown) + 2e-5 * random.standard_normal(SAMPLES)])
        np.savetxt(folder / f"trial_{trial}.csv", rows, delimiter=",", header="t,F,x", comments="", fmt="%.9g")
    return folder


def late(force: np.ndarray, time_constant: float = 0.05) -> np.ndarray:
    """A lag of first order, begun at rest with what the force was."""
    found, z = np.empty_like(force), force[0]
    for k, value in enumerate(force):
        z += STEP / PARTS * (value - z) / time_constant
        found[k] = z
    return found


def slow(force: np.ndarray) -> np.ndarray:
    """No faster than 20 N/s."""
    found, z = np.empty_like(force), force[0]
    for k, value in enumerate(force):
        z += float(np.clip(value - z, -20.0 * STEP / PARTS, 20.0 * STEP / PARTS))
        found[k] = z
    return found


def sign(v: float) -> float:
    return float(np.tanh(v / 1e-3))


class Shaking:
    """A force of one frequency that begins each trial with another phase."""

    def __init__(self, size: float, hertz: float) -> None:
        self.size, self.hertz, self.phase = size, hertz, 0.0

    def __call__(self, t: float, x: float, v: float, force: float) -> float:
        self.phase += 2.0 if t == 0 else 0.0
        return self.size * float(np.sin(2 * np.pi * self.hertz * t + self.phase))


CASES: dict[str, tuple[Act, Extra, str, Mapping[str, float]]] = {
    "square": (lambda f: 0.2 * f * np.abs(f), _nothing, "input_curve", {"a": -1.0, "b": 0.2}),
    "rate": (slow, _nothing, "rate_limit", {"rate": 20.0, "share": 1.0}),
    "dead_zone": (
        lambda f: np.sign(f) * np.maximum(np.abs(f) - 0.8, 0.0),
        _nothing,
        "dead_zone",
        {"width": 0.8, "share": 1.0},
    ),
    "saturation": (lambda f: np.clip(f, -4.0, 4.0), _nothing, "saturation", {"limit": 4.0, "share": 1.0}),
    "load": (_as_given, lambda t, x, v, f: -0.15 * abs(f) * sign(v), "load_dependent_friction", {"mu": 0.15}),
    "ripple": (
        _as_given,
        lambda t, x, v, f: 0.6 * np.sin(60.0 * x) + 0.5 * np.cos(60.0 * x),
        "force_ripple",
        {"sine": 0.6, "cosine": 0.5, "wavenumber": 60.0},
    ),
    "limit": (
        _as_given,
        lambda t, x, v, f: 30.0 * np.sign(x) * max(abs(x) - 0.12, 0.0),
        "limited_drive",
        {"k": 30.0, "qLimit": 0.12},
    ),
    "cube": (_as_given, lambda t, x, v, f: -1.5 * v**3, "cubic_drag", {"c3": 1.5}),
    "shaking": (_as_given, Shaking(0.5, 4.3), "periodic_force", {"amplitude": 0.5, "frequency": 4.3}),
    "moment": (_as_given, lambda t, x, v, f: 0.4 * (t > 2.0), "step_force", {"f0": 0.4, "tBegin": 2.0}),
}


@pytest.mark.parametrize("case", CASES)
def test_a_rare_law_is_named_with_its_values(case: str, tmp_path: Path) -> None:
    act, extra, expected, values = CASES[case]
    found = diagnosed(record(tmp_path, act, extra))
    assert (found.verdict, found.incomplete) == ("named", False)
    (effect,) = found.effects
    assert effect.id == expected
    assert {name: effect.parameters[name].value for name in values} == pytest.approx(values, rel=0.03)
    assert found.held_out.reducible_removed > 0.95


@pytest.mark.parametrize(
    ("balance", "position", "expected"),
    [
        ("N.m", "rad", {"cogging"}),
        ("rad/s2", "rad", {"cogging"}),
        ("N", "m", {"force_ripple"}),
        ("m/s2", "m", {"force_ripple"}),
    ],
)
def test_what_repeats_with_an_angle_or_a_way_fits_a_balance_of_forces_or_of_accelerations(
    balance: str, position: str, expected: set[str]
) -> None:
    place = Place(
        "motion",
        "q",
        balance,
        {"q": "q", "v": "v", "t": "time"},
        units={"position": position},
        scales={"position": 1.0},
    )
    assert {law.id for law in laws() if law.id in ("cogging", "force_ripple") and fits(law, place)} == expected


def test_a_lag_of_a_linear_plants_input_is_called_like_one_of_its_sensor(tmp_path: Path) -> None:
    found = diagnosed(record(tmp_path, late))
    assert found.verdict == "ambiguous"
    assert {"input_lag", "sensor_lag"} <= {name for group in found.confusable for name in group}
    (effect,) = found.effects
    assert effect.parameters["T"].value == pytest.approx(0.05, rel=0.03)


def test_friction_that_grows_with_the_position_is_named_beside_dry_friction(tmp_path: Path) -> None:
    found = diagnosed(record(tmp_path, extra=lambda t, x, v, f: -(0.5 + 2.0 * x) * sign(v)))
    values = {e.id: next(iter(e.parameters.values())).value for e in found.effects}
    assert found.verdict == "named"
    assert values == pytest.approx({"coulomb_friction": 0.5, "position_dependent_friction": 2.0}, rel=0.03)


def test_common_friction_is_not_taken_for_a_dead_zone(tmp_path: Path) -> None:
    found = diagnosed(record(tmp_path, extra=lambda t, x, v, f: -0.4 * sign(v)))
    assert [effect.id for effect in found.effects] == ["coulomb_friction"]


def test_a_delay_is_written_into_the_users_own_equation(tmp_path: Path) -> None:
    (tmp_path / "Slide.mo").write_text(SLIDE)
    base = find_modelica_model(f"{tmp_path / 'Slide.mo'}:Slide")
    values = {"share": Estimate(1.0, "1", (1.0, 1.0)), "T": Estimate(0.04, "s", (0.04, 0.04))}
    added = with_effects(base, [NamedEffect("input_delay", "F", values)], "Late")
    system = added.compile()
    assert len(system.states) == 4 and [v.name for v in system.inputs] == ["F"]


def test_crosstalk_is_written_from_one_input_to_the_other(tmp_path: Path) -> None:
    text = SLIDE.replace("input Real F", 'input Real G(unit="N");\n  input Real F').replace(
        "= F - k*x", "= F + G - k*x"
    )
    (tmp_path / "Slide.mo").write_text(text)
    base = find_modelica_model(f"{tmp_path / 'Slide.mo'}:Slide")
    effect = NamedEffect("crosstalk", "G->F", {"k": Estimate(0.25, "1", (0.2, 0.3))})
    system = with_effects(base, [effect], "Mixed").compile()
    p = [v.start for v in system.parameters]
    rate = [float(system.rhs(0.0, [0.0, 0.0], u, [], p)[0][1]) for u in ([1.0, 0.0], [0.0, 1.0])]
    names = [v.name for v in system.inputs]
    assert dict(zip(names, rate, strict=True)) == pytest.approx({"F": 0.5, "G": 0.5 * 1.25})
