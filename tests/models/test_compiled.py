"""Compiled free runs: closed forms, delays, sensitivities against finite differences."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from threading import Barrier

import casadi as ca
import numpy as np
import pytest
from scipy import linalg

from fmus.catalogue import ModelicaModel, find_modelica_model
from fmus.errors import ComponentError, ModelicaError
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.models.compiled import (
    FOR_LONG_SUMS,
    WIDE,
    CompiledModel,
    _without_repetitions,
    level_for_long_sums,
    linear_answer,
)
from orchestrator.models.patch import Attachment, check_attached, patched_model

TIME = np.linspace(0, 1, 501)


def lag(delay: float = 0.0) -> SymbolicSystem:
    """tau dx/dt = u(t - delay) - x, y = 2 x + u."""
    t, x, u, d, p = (ca.SX.sym(name) for name in "txudp")
    both = ca.vertcat(p, ca.SX.sym("delay"))
    return SymbolicSystem(
        name="Lag",
        description="",
        inputs=(Variable("u"),),
        states=(Variable("x", start=0.0),),
        algebraics=(Variable("y"),),
        parameters=(Variable("tau", "s", start=0.1), Variable("delay", "s", start=delay)),
        dependents=(),
        outputs=("y",),
        rhs=ca.Function("rhs", [t, x, u, d, both], [(d - x) / p, 2 * x + u]),
        history=ca.Function("history", [t, u, both], [u, both[1]]),
        dependent=ca.Function("dependent", [both], [ca.SX(0, 1)]),
        initial=ca.Function("initial", [both], [ca.SX(0)]),
    )


def test_compiled_extremes_and_squares_are_those_of_the_mathematical_library() -> None:
    u, v, x = ca.SX.sym("u"), ca.SX.sym("v"), ca.SX.sym("x")
    y = ca.vertcat(ca.fmin(u, v), ca.fmax(u, v), v**2 * x)
    names = ("least", "most", "square")
    nothing, t, d, p = ca.SX(0, 1), ca.SX.sym("t"), ca.SX.sym("d", 0), ca.SX.sym("p", 0)
    inputs, function = ca.vertcat(u, v), ca.Function
    system = SymbolicSystem(
        name="Extremes",
        description="",
        inputs=(Variable("u"), Variable("v")),
        states=(Variable("x", start=1.0),),
        algebraics=tuple(Variable(name) for name in names),
        parameters=(),
        dependents=(),
        outputs=names,
        rhs=function("rhs", [t, x, inputs, d, p], [0 * x, y]),
        history=function("history", [t, inputs, p], [nothing, nothing]),
        dependent=function("dependent", [p], [nothing]),
        initial=function("initial", [p], [ca.SX(1)]),
    )
    model = CompiledModel(system, names)

    # A value that is no number is neither the least nor the most.
    for pair in [(1.0, 2.0), (2.0, -3.0), (np.nan, 5.0), (-7.0, -7.0)]:
        run = model.run(np.array([0.0, 1.0]), np.array([pair, pair]), np.zeros(0), np.ones(1))
        assert run.outputs[-1].tolist() == [np.fmin(*pair), np.fmax(*pair), pair[1] ** 2]


@pytest.mark.parametrize("delay", [0.0, 0.0007, 0.1, 0.7])
def test_delayed_ramp_through_a_lag_follows_its_closed_form(delay: float) -> None:
    model = CompiledModel(lag(delay), ["y"])

    y = model.run(TIME, TIME[:, None], model.parameters, np.zeros(1), substeps=2).outputs[:, 0]

    late = np.maximum(TIME - delay, 0)
    expected = 2 * (late - 0.1 * (1 - np.exp(-late / 0.1))) + TIME
    # The kink inside a step of 1 ms costs the fourth-order method about step^2.
    assert np.abs(y - expected).max() < 2e-6


def test_runs_of_a_delayed_model_one_after_the_other_are_those_of_a_fresh_one() -> None:
    model, inputs = CompiledModel(lag(), ["y"], ["tau", "delay"]), np.sin(9 * TIME)[:, None]

    for delay in (0.1, 0.03):
        for _ in range(2):  # of the same array with other values, too
            fresh = CompiledModel(lag(), ["y"], ["tau", "delay"])
            values = model.with_values([0.1, delay])
            again, once = (m.run(TIME, inputs, values, np.zeros(1)).outputs for m in (model, fresh))
            assert np.array_equal(again, once)
            inputs[:] = np.cos(5 * inputs)


def test_sensitivities_equal_central_differences_including_the_delay() -> None:
    model = CompiledModel(lag(0.1003), ["y"], ["tau", "delay"])
    inputs = np.sin(9 * TIME)[:, None]

    def run(tau: float, delay: float, start: float) -> np.ndarray:
        return model.run(TIME, inputs, model.with_values([tau, delay]), np.array([start])).outputs[:, 0]

    slopes = model.run(
        TIME, inputs, model.with_values([0.1, 0.1003]), np.array([0.2]), sensitivities=True
    ).sensitivities
    assert slopes is not None
    e = 1e-6
    for k, step in enumerate([(0, 0, e), (e, 0, 0), (0, e, 0)]):
        up = run(0.1 + step[0], 0.1003 + step[1], 0.2 + step[2])
        down = run(0.1 - step[0], 0.1003 - step[1], 0.2 - step[2])
        # Inputs are piecewise linear, so the slope in the delay jumps at kinks: compare away from single samples.
        assert np.quantile(np.abs((up - down) / (2 * e) - slopes[:, 0, k]), 0.9) < 1e-3 * np.abs(slopes[:, 0, k]).max()


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.0113, 0.3])
def test_a_held_input_is_held_behind_a_delay_too(delay: float) -> None:
    time, free = np.linspace(0, 1, 51), ["tau", "delay"]
    inputs = np.random.default_rng(5).standard_normal((51, 1))
    model = CompiledModel(lag(delay), ["y"], free, held=["u"])

    run = model.run(time, inputs, model.parameters, np.zeros(1), substeps=40, sensitivities=True)

    # Each step of the input adds 1 - exp(-t/tau) from its time on; before the first sample it was as that.
    steps = np.diff(np.concatenate([[0.0], inputs[:, 0]]))
    began = np.concatenate([[0.0], time[1:] + delay])
    since = np.maximum(time[:, None] - began[None, :], 0.0)
    x = (1 - np.exp(-since / 0.1)) @ steps
    # A step inside a step of the integration of 0.5 ms is spread over it.
    assert np.abs(run.outputs[:, 0] - (2 * x + inputs[:, 0])).max() < 1e-4
    # Slopes are those of an input without steps: what a delay of half an interval more and less differs by.
    e = 0.01
    late, soon = (
        model.run(time, inputs, model.with_values([0.1, delay + d]), np.zeros(1), substeps=40).outputs[:, 0]
        for d in (e, -e)
    )
    if delay > e:
        slope = (late - soon) / (2 * e)
        assert run.sensitivities is not None
        assert np.abs(slope - run.sensitivities[:, 0, 2]).max() < 1e-2 * np.abs(slope).max()


def test_error_shrinks_with_the_fourth_power_of_the_step() -> None:
    model = CompiledModel(find_modelica_model("arm").compile(), ["q1", "q2"])
    inputs = np.tile([0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 1.0, -1.0, 0, 0], (51, 1))
    time, start = np.linspace(0, 1, 51), np.array([0.8, 1.2, 1.0, -1.0])
    runs = [model.run(time, inputs, model.parameters, start, substeps=n).outputs for n in (4, 8, 64)]

    coarse, fine = (np.abs(run - runs[2]).max() for run in runs[:2])

    assert 3.0 < np.log2(coarse / fine) < 5.0


def test_run_that_leaves_the_finite_numbers_names_the_time() -> None:
    model = CompiledModel(lag(), ["y"])
    with pytest.raises(ComponentError, match=r"Lag left the finite numbers at t = 0\.\d+ s"):
        model.run(TIME, np.ones((len(TIME), 1)), np.array([-1e-3, 0.0]), np.zeros(1))


def test_effect_that_the_front_end_drops_is_noticed() -> None:
    arm = find_modelica_model("arm")
    attachment = Attachment(
        "jointTorque1", "FESArm.Effects.JointTorque.ViscousFriction", {"b": {"b[1]": 0.1, "b[2]": 0.2}}
    )
    patched = patched_model(arm, "Patched", [attachment])

    check_attached(patched.compile(), [attachment])
    with pytest.raises(ModelicaError, match="did not arrive in slot jointTorque1 of FESArm.Arms.Arm"):
        check_attached(ModelicaModel("arm", "FESArm.Arms.Arm").compile(), [attachment])


def test_slopes_in_start_values_of_a_linear_system_are_its_matrix_exponential() -> None:
    size = 11  # more columns than a wide register holds, and not a multiple of it
    a = np.random.default_rng(1).normal(size=(size, size)) * (np.random.default_rng(2).random((size, size)) < 0.4)
    t, x, u, d, p = (ca.SX.sym(name, n) for name, n in zip("txudp", (1, size, 1, 0, 1), strict=True))
    nothing = ca.SX(0, 1)
    system = SymbolicSystem(
        name="Linear",
        description="",
        inputs=(Variable("u"),),
        states=tuple(Variable(f"x{k}", start=0.0) for k in range(size)),
        algebraics=(),
        parameters=(Variable("p", start=1.0),),
        dependents=(),
        outputs=tuple(f"x{k}" for k in range(size)),
        rhs=ca.Function("rhs", [t, x, u, d, p], [p * ca.SX(ca.DM(a)) @ x, nothing]),
        history=ca.Function("history", [t, u, p], [nothing, nothing]),
        dependent=ca.Function("dependent", [p], [nothing]),
        initial=ca.Function("initial", [p], [ca.SX.zeros(size)]),
    )
    model = CompiledModel(system, system.outputs, ["p"])
    start = np.linspace(-1, 1, size)

    run = model.run(TIME, np.zeros((len(TIME), 1)), model.parameters, start, sensitivities=True)

    assert run.sensitivities is not None
    carried = linalg.expm(a)
    assert np.allclose(run.sensitivities[-1, :, :size], carried, atol=1e-9)
    # At p = 1, d/dp exp(p a t) x0 = a t exp(a t) x0
    assert np.allclose(run.sensitivities[-1, :, size], a @ carried @ start, atol=1e-8)


def test_answer_of_a_linear_system_equals_the_recurrence_written_out() -> None:
    random = np.random.default_rng(3)
    n, nx, nu, ny, k = 40, 3, 2, 2, 5
    shapes = [(n - 1, nx, nx), (n, nx, nu), (n, ny, nx), (n, ny, nu), (n, nu, k)]
    step, push, show, direct, changes = (random.normal(size=shape) for shape in shapes)
    step, half = 0.4 * step, random.random(n - 1)

    answers = linear_answer(half, step, push, show, direct, changes)

    x = np.zeros((nx, k))
    for i in range(n):
        assert np.allclose(answers[i], show[i] @ x + direct[i] @ changes[i])
        if i < n - 1:
            x = step[i] @ (x + half[i] * push[i] @ changes[i]) + half[i] * push[i + 1] @ changes[i + 1]


@pytest.mark.parametrize(
    ("cpu", "wide"),
    [
        ("flags\t\t: fpu sse2 avx2 fma\nbugs\t: spectre\n", True),
        ("flags\t\t: fpu sse2 avx\nbugs\t: no avx2, no fma\n", False),  # 2011
        ("Features\t: fp asimd\n", False),  # Arm
        (None, False),
    ],
)
def test_long_sums_use_vectors_of_four_only_where_the_processor_has_them(
    cpu: str | None, wide: bool, tmp_path: Path
) -> None:
    if cpu is not None:
        (tmp_path / "cpuinfo").write_text(cpu)
    assert level_for_long_sums(tmp_path / "cpuinfo") == f"{FOR_LONG_SUMS} {WIDE}" * wide + FOR_LONG_SUMS * (not wide)


def test_a_long_sum_of_exponentials_is_the_same_however_wide_its_vectors_are() -> None:
    points, weights = np.linspace(-2.0, 2.0, 301), np.sin(np.arange(301.0))
    t, x, u, d, p = (ca.MX.sym(name, n) for name, n in zip("txudp", (1, 1, 1, 0, 0), strict=True))
    total = ca.dot(ca.DM(weights), ca.exp(-0.5 * (ca.DM(points) - u) ** 2))
    system = replace(
        lag(),
        parameters=(),
        rhs=ca.Function("rhs", [t, x, u, d, p], [-x, total]),
        history=ca.Function("history", [t, u, p], [ca.MX(0, 1), ca.MX(0, 1)]),
        dependent=ca.Function("dependent", [p], [ca.MX(0, 1)]),
        initial=ca.Function("initial", [p], [ca.DM(0)]),
    )
    model = CompiledModel(system, ["y"], level=level_for_long_sums())
    at = np.cos(7 * TIME)
    run = model.run(TIME, at[:, None], model.parameters, np.zeros(1), sensitivities=True)
    truth = np.exp(-0.5 * (points - at[:, None]) ** 2) @ weights
    np.testing.assert_allclose(run.outputs[:, 0], truth, rtol=0, atol=1e-12)


def test_threads_that_share_a_model_not_yet_compiled_get_the_same_run() -> None:
    model = CompiledModel(lag(), ["y"], ["tau"])
    everybody = Barrier(8, timeout=60)

    def run(_: int) -> tuple[np.ndarray, np.ndarray | None]:
        everybody.wait()
        found = model.run(TIME, TIME[:, None], model.parameters, np.zeros(1), substeps=20, sensitivities=True)
        return found.outputs, found.sensitivities

    with ThreadPoolExecutor(8) as pool:
        runs = list(pool.map(run, range(8)))

    alone = CompiledModel(lag(), ["y"], ["tau"])
    expected = alone.run(TIME, TIME[:, None], alone.parameters, np.zeros(1), substeps=20, sensitivities=True)
    for outputs, slopes in runs:
        assert np.array_equal(outputs, expected.outputs)
        assert np.array_equal(slopes, expected.sensitivities)


@pytest.mark.parametrize(("states", "free"), [(1, 7), (7, 1), (8, 0), (11, 6), (16, 16)])
def test_sensitivities_of_a_linear_system_are_the_polynomial_of_its_matrix(states: int, free: int) -> None:
    # x' = A x + B p: a Runge-Kutta step of fourth order is 1 + hM + ... + (hM)^4/24 of M = [A B; 0 0].
    random = np.random.default_rng(states)
    matrix = np.zeros((states + free, states + free))
    matrix[:states] = random.normal(size=(states, states + free)) * (random.random((states, states + free)) < 0.6)
    t, x, u, d, p = (ca.SX.sym(n, k) for n, k in zip("txudp", (1, states, 0, 0, free), strict=True))
    nothing, names = ca.SX(0, 1), [f"x{k}" for k in range(states)]
    system = SymbolicSystem(
        name="Linear",
        description="",
        inputs=(),
        states=tuple(Variable(name) for name in names),
        algebraics=(),
        parameters=tuple(Variable(f"p{k}") for k in range(free)),
        dependents=(),
        outputs=tuple(names),
        rhs=ca.Function("rhs", [t, x, u, d, p], [ca.mtimes(ca.DM(matrix[:states]), ca.vertcat(x, p)), nothing]),
        history=ca.Function("history", [t, u, p], [nothing, nothing]),
        dependent=ca.Function("dependent", [p], [nothing]),
        initial=ca.Function("initial", [p], [ca.SX(states, 1)]),
    )
    model = CompiledModel(system, names, [v.name for v in system.parameters])
    values, start, time = random.normal(size=free), random.normal(size=states), np.array([0.0, 0.1, 0.3])

    run = model.run(time, np.zeros((3, 0)), values, start, substeps=2, sensitivities=True)

    whole = np.eye(states + free)
    for k, h in enumerate([0.05, 0.1], start=1):
        powers = np.array([np.linalg.matrix_power(h * matrix, order) for order in range(5)])
        step = np.tensordot([1, 1, 1 / 2, 1 / 6, 1 / 24], powers, axes=1)
        whole = np.linalg.matrix_power(step, 2) @ whole
        assert run.sensitivities is not None
        assert np.allclose(run.sensitivities[k], whole[:states], rtol=1e-12, atol=1e-13)
        assert np.allclose(run.outputs[k], whole[:states] @ np.r_[start, values], rtol=1e-12, atol=1e-13)


def test_a_slope_that_is_computed_with_its_function_costs_no_second_sine() -> None:
    t, x, u, d, p = (ca.SX.sym(n, k) for n, k in zip("txudp", (1, 1, 0, 0, 1), strict=True))
    value = ca.sin(p * x) * ca.sin(p * x)  # two nodes of the same formula
    repeated = ca.Function("model_fj", [t, x, u, d, p], [value, ca.jacobian(value, ca.vertcat(x, p))])

    once = _without_repetitions(repeated)

    sines = [[f.instruction_id(k) for k in range(f.n_instructions())].count(ca.OP_SIN) for f in (repeated, once)]
    assert sines[0] > 1 and sines[1] == 1
    at = [ca.DM(0.0), ca.DM(0.7), ca.DM(0, 1), ca.DM(0, 1), ca.DM(1.3)]
    for expected, found in zip(repeated.call(at), once.call(at), strict=True):
        assert np.array_equal(expected.full(), found.full())
