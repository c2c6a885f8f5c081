"""A free run of a model without damping is another swing altogether after some seconds; what it lacks is named all the same."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import find_modelica_model
from orchestrator.diagnose import diagnose
from orchestrator.measurements import load_measurements

ARM, MASS, OWN_INERTIA, GRAVITY = 0.147755, 0.147585, 1.0912e-4, 9.81001
DRAG, NOISE = 5.97e-8, 1e-4


def test_every_effect_is_fitted_alone_where_free_runs_lose_the_swing_and_drag_is_named(tmp_path: Path) -> None:
    time = np.arange(0.0, 30.0, 0.004)
    inertia = OWN_INERTIA + MASS * ARM**2

    def rates(_: float, x: np.ndarray) -> list[float]:
        return [x[1], (MASS * GRAVITY * ARM * np.sin(x[0]) - DRAG * x[1] * abs(x[1])) / inertia]

    swing = solve_ivp(rates, (0.0, 30.0), [6.0679, 1.654], t_eval=time, rtol=1e-11, atol=1e-12).y[0]
    rows = np.column_stack([time, swing + NOISE * np.random.default_rng(5).standard_normal(len(time))])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="time,theta", comments="", fmt="%.9g")
    (tmp_path / "case.toml").write_text(
        'files = ["a.csv"]\nlearning_window_s = [0.0, 19]\nheld_out_window_s = [19, 29.996]\n'
        f'[columns]\ntime = "s"\ntheta = "rad"\n[sensors]\ntheta_noise_std_rad = {NOISE}\n'
    )
    said: list[str] = []
    model, data = find_modelica_model("pendulum"), load_measurements(str(tmp_path))
    found = diagnose(model, data, workers=1, progress=said.append)
    refitted = [text.partition(": ")[2] for text in said if text.startswith("refitting")]
    alone = {text.partition(" at ")[0] for text in refitted if " and " not in text}
    # By slopes along the free runs these explain the least.
    assert {"coulomb_friction", "joint_offset", "rotor_inertia"} <= alone
    assert found.verdict == "named"
    (effect,) = found.effects
    assert effect.id == "quadratic_drag"
    assert effect.parameters["c[1]"].value == pytest.approx(DRAG, rel=0.02)
