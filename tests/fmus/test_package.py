"""Generated FMUs against closed forms, and against calls that the standard forbids."""

import math
import subprocess
from collections.abc import Callable
from ctypes import byref, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path

import fmpy  # type: ignore[import-untyped]
import numpy as np
import pytest
from helpers_slave import DISCARD, ERROR, OK, Slave
from helpers_systems import integrator, lag, oscillator, pendulum, root
from scipy.integrate import solve_ivp  # type: ignore[import-untyped]

from fmus.archive import extract_fmu, read_archive
from fmus.errors import FmuError, MisfitError
from fmus.package import build_fmu
from fmus.runtime import compiler
from fmus.symbolic.system import SymbolicSystem, Variable
from fmus.validate import validate_fmu

SYSTEMS: dict[str, Callable[[], SymbolicSystem]] = {
    "lag": lag,
    "oscillator": oscillator,
    "pendulum": pendulum,
    "integrator": integrator,
    "root": root,
}
Start = Callable[[str], Slave]


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    stops = {"root": 0.5}  # s; it has no derivative any more at t = 0.614 s
    return {
        name: build_fmu(make(), folder / f"{name}.fmu", stop_time=stops.get(name, 10.0))
        for name, make in SYSTEMS.items()
    }


@pytest.fixture
def create(fmus: dict[str, Path], tmp_path: Path) -> Start:
    """An instance that has been created and nothing more."""
    return lambda name: Slave(fmus[name], tmp_path / name)


def lag_answer(time: float, arrival: float, tau: float = 0.2) -> float:
    """Response of the lag to a unit step that arrives at `arrival` s."""
    return 1.0 - math.exp(-(time - arrival) / tau) if time > arrival else 0.0


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_built_fmu_has_no_findings(fmus: dict[str, Path], name: str) -> None:
    assert validate_fmu(fmus[name]) == []


def test_the_oscillator_follows_its_closed_form(create: Start) -> None:
    w0, damping = 3.0, 0.1
    rate, frequency = damping * w0, w0 * math.sqrt(1 - damping**2)
    with create("oscillator").start() as slave:
        for _ in range(2500):
            slave.step(0.004)
        t = slave.time
        turned = math.cos(frequency * t) + rate / frequency * math.sin(frequency * t)
        assert slave.get("q") == pytest.approx(0.5 * math.exp(-rate * t) * turned, abs=1e-9)


@pytest.mark.parametrize("step", [0.004, 0.1, 10.0])
def test_the_pendulum_agrees_with_another_integrator(create: Start, step: float) -> None:
    exact = solve_ivp(
        lambda t, x: [x[1], -9.81 * np.sin(x[0]) - 0.1 * x[1]],
        (0.0, 10.0),
        [1.0, 0.0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-13,
    ).y[:, -1]
    with create("pendulum").start(tolerance=1e-9) as slave:
        for _ in range(round(10.0 / step)):
            slave.step(step)
        assert [slave.get("q"), slave.get("w")] == pytest.approx(exact, abs=1e-7)


def test_step_sizes_do_not_change_the_trajectory(create: Start) -> None:
    sizes = np.random.default_rng(7).dirichlet(np.full(300, 0.5)) * 5.0
    with create("pendulum").start(tolerance=1e-10) as slave:
        for size in sizes[sizes > 0]:
            slave.step(float(size))
        varied = slave.get("q")
        slave.insist("fmi2Reset")
        slave.time = 0.0
        slave.start(tolerance=1e-10).step(5.0)
        assert varied == pytest.approx(slave.get("q"), abs=1e-8)


@pytest.mark.parametrize("delay", [0.0, 0.0013, 0.004, 0.01, 0.0317, 0.37])
def test_a_delayed_step_arrives_on_time(create: Start, delay: float) -> None:
    with create("lag").start(T=delay) as slave:
        for _ in range(25):
            slave.step(0.004)
        begin = slave.time
        slave.set(u=1.0)
        for _ in range(200):
            slave.step(0.004)
            assert slave.get("x") == pytest.approx(lag_answer(slave.time, begin + delay), abs=1e-7)
            # Half a microsecond on either side of the arrival rounding decides.
            if abs(slave.time - begin - delay) > 5e-7:
                assert slave.get("late") == float(slave.time > begin + delay)


@pytest.mark.parametrize("delay", [0.0, 0.07, 0.5, 0.83])
def test_steps_longer_than_the_delay_lose_nothing(create: Start, delay: float) -> None:
    with create("lag").start(T=delay, u=0.0) as slave:
        slave.set(u=1.0)
        for size in (0.5, 0.9, 0.25):
            slave.step(size)
            assert slave.get("x") == pytest.approx(lag_answer(slave.time, delay), abs=1e-7)


def test_before_the_start_a_delayed_input_had_its_initial_value(create: Start) -> None:
    with create("lag").start(u=3.0) as slave:
        slave.step(0.05)
        assert slave.get("late") == 3.0
        assert slave.get("x") == pytest.approx(3.0 * lag_answer(0.05, 0.0), abs=1e-8)


def test_pulses_come_out_of_a_long_delay_in_order(create: Start) -> None:
    pulses = np.random.default_rng(3).integers(0, 5, 100).astype(float)
    with create("lag").start(T=0.2, u=pulses[0]) as slave:
        late = []
        for pulse in pulses:
            slave.set(u=float(pulse))
            slave.step(0.01)
            late.append(slave.get("late"))
    # The pulse of step k holds on [k, k+1) steps, so after step k that of 20 steps before k + 1 is out.
    assert late[:19] == [pulses[0]] * 19
    assert late[19:] == list(pulses[:81])


def test_a_ramp_input_is_integrated_exactly(create: Start) -> None:
    with create("integrator").start() as slave:
        for size in (0.5, 0.03, 1.0):
            slave.set(u=2.0 * slave.time)
            slave.slope(u=2.0)
            slave.step(size)
            now = slave.time
            assert slave.get("a") == pytest.approx(now**2, abs=1e-12)
            assert slave.get("b") == pytest.approx((now - 0.1) ** 2, abs=1e-12)
            assert slave.get("u") == pytest.approx(2.0 * now, abs=1e-12)


def test_an_input_slope_lasts_for_one_step(create: Start) -> None:
    with create("integrator").start() as slave:
        slave.slope(u=1.0)
        slave.step(1.0)
        slave.step(1.0)
        assert slave.get("a") == pytest.approx(0.5 + 1.0, abs=1e-12)


@pytest.mark.parametrize("name", ["lag", "oscillator"])
def test_a_restored_state_continues_bit_for_bit(create: Start, name: str) -> None:
    def drive(slave: Slave) -> list[float]:
        seen = []
        for k in range(60):
            slave.set(u=math.sin(k))
            slave.slope(u=0.5)
            slave.step(0.004 + 0.001 * (k % 3))
            seen += [slave.get(variable) for variable in slave.references]
        return seen

    with create(name).start() as slave:
        drive(slave)
        begin, state = slave.time, slave.save()
        content = slave.to_bytes(state)
        first = drive(slave)
        slave.insist("fmi2SetFMUstate", state)
        slave.time = begin
        again = drive(slave)
        slave.insist("fmi2FreeFMUstate", byref(state))
        copy = slave.from_bytes(content)
        slave.insist("fmi2SetFMUstate", copy)
        slave.time = begin
        from_bytes = drive(slave)
        slave.insist("fmi2FreeFMUstate", byref(copy))
    assert first == again == from_bytes


def test_two_instances_do_not_disturb_each_other(fmus: dict[str, Path], tmp_path: Path) -> None:
    def run(slaves: list[Slave]) -> list[float]:
        for _ in range(50):
            for slave in slaves:
                slave.step(0.01)
        return [slave.get("x") for slave in slaves]

    def slave(u: float, tau: float) -> Slave:
        return Slave(fmus["lag"], tmp_path / "lag").start(u=u, tau=tau, T=0.013)

    with slave(1.0, 0.2) as one, slave(-2.0, 0.5) as two:
        together = run([one, two])
    with slave(1.0, 0.2) as one:
        alone = run([one])
    with slave(-2.0, 0.5) as two:
        alone += run([two])
    assert together == alone


def test_start_values_follow_parameters_unless_they_are_set(create: Start) -> None:
    with create("oscillator").start(swing=0.8) as slave:
        assert slave.get("q") == 0.4
        slave.insist("fmi2Reset")
        slave.start(swing=0.8, q=0.1)
        assert slave.get("q") == 0.1
        assert slave.get("energy") == pytest.approx((3.0 * 0.1) ** 2 / 2, rel=1e-15)


def test_a_tuned_parameter_changes_derivatives_and_dependents_at_once(
    create: Start,
) -> None:
    with create("lag").start(u=1.0) as slave:
        assert slave.get("der(x)") == pytest.approx(5.0)
        slave.set(tau=0.1)
        assert slave.get("der(x)") == pytest.approx(10.0)
        assert slave.get("rate") == pytest.approx(10.0)
        slave.step(0.1)
        assert slave.get("x") == pytest.approx(1 - math.exp(-1.0), abs=1e-8)


REFUSALS = {
    "der(x)": "'der(x)' is computed by the model and cannot be set",
    "x": "state 'x' can be set before and during initialization only",
}


@pytest.mark.parametrize("name", REFUSALS)
def test_setting_what_the_model_computes_is_refused(create: Start, name: str) -> None:
    with create("lag").start() as slave:
        assert slave.call("fmi2SetReal", *slave.one(name), byref(c_double(1.0))) == ERROR
        assert slave.messages == [f"fmi2SetReal: {REFUSALS[name]}"]


def test_bad_values_are_refused_with_the_name_of_the_variable(create: Start) -> None:
    one, nan = byref(c_double(1.0)), byref(c_double(math.nan))
    with create("lag").start() as slave:
        assert slave.call("fmi2SetReal", *slave.one("u"), nan) == ERROR
        assert slave.call("fmi2SetReal", byref(c_uint(999)), c_size_t(1), one) == ERROR
        assert slave.call("fmi2GetReal", byref(c_uint(999)), c_size_t(1), one) == ERROR
        assert slave.call("fmi2GetReal", None, c_size_t(1), one) == ERROR
        assert slave.call("fmi2GetInteger", byref(c_uint(0)), c_size_t(1), one) == ERROR
        second = byref(c_int(2))
        assert slave.call("fmi2SetRealInputDerivatives", *slave.one("u"), second, one) == ERROR
        first = byref(c_int(1))
        assert slave.call("fmi2SetRealInputDerivatives", *slave.one("x"), first, one) == ERROR
        assert slave.messages == [
            "fmi2SetReal: 'u' = nan is not a finite number",
            "fmi2SetReal: value reference 999 is unknown; this model has 0 to 7",
            "fmi2GetReal: value reference 999 is unknown; this model has 0 to 7",
            "fmi2GetReal: null pointer for 1 values",
            "fmi2GetInteger: value reference 0 is of type Real",
            "fmi2SetRealInputDerivatives: order 2 is not supported; only first derivatives are",
            "fmi2SetRealInputDerivatives: 'x' is not an input",
        ]
        slave.step(0.01)


@pytest.mark.parametrize(
    ("time", "size", "message"),
    [
        (0.0, -0.1, "step size -0.1 s at t = 0 s; it must be positive"),
        (0.0, 0.0, "step size 0 s at t = 0 s; it must be positive"),
        (0.0, math.nan, "step size nan s at t = 0 s; it must be positive"),
        (1.0, 0.1, "the step starts at t = 1 s, but the model is at t = 0 s"),
        (math.inf, 0.1, "the step starts at t = inf s, but the model is at t = 0 s"),
    ],
)
def test_impossible_steps_are_refused(create: Start, time: float, size: float, message: str) -> None:
    with create("lag").start() as slave:
        assert slave.call("fmi2DoStep", c_double(time), c_double(size), 1) == ERROR
        assert slave.messages == [f"fmi2DoStep: {message}"]
        slave.step(0.1)


def test_calls_out_of_order_are_refused(create: Start) -> None:
    with create("lag") as slave:
        assert slave.call("fmi2DoStep", c_double(0.0), c_double(0.1), 1) == ERROR
        assert slave.call("fmi2GetReal", *slave.one("x"), byref(c_double())) == ERROR
        assert slave.call("fmi2ExitInitializationMode") == ERROR
        slave.start()
        assert slave.call("fmi2EnterInitializationMode") == ERROR
        slave.insist("fmi2Terminate")
        assert slave.call("fmi2SetReal", *slave.one("u"), byref(c_double())) == ERROR
        assert slave.messages == [
            "fmi2DoStep: not allowed while the FMU is instantiated",
            "fmi2GetReal: not allowed while the FMU is instantiated",
            "fmi2ExitInitializationMode: not allowed while the FMU is instantiated",
            "fmi2EnterInitializationMode: not allowed while the FMU is stepping",
            "fmi2SetReal: not allowed while the FMU is terminated",
        ]


def test_calls_without_an_instance_do_not_crash(create: Start) -> None:
    with create("lag") as slave:
        for function in ("fmi2Reset", "fmi2Terminate", "fmi2EnterInitializationMode"):
            assert getattr(slave.library, function)(None) == ERROR
        assert slave.library.fmi2GetReal(None, None, c_size_t(1), None) == ERROR
        assert slave.library.fmi2GetFMUstate(None, None) == ERROR
        assert slave.library.fmi2GetRealStatus(None, 2, None) == ERROR
        slave.library.fmi2FreeInstance(None)


def test_a_wrong_guid_or_interface_gives_no_instance(create: Start) -> None:
    with create("lag") as slave:
        assert slave.instantiate("{0}") is None
        assert slave.instantiate("{0}", kind=2) is None
        assert slave.messages[0].startswith("fmi2Instantiate: the GUID is not that of this FMU, {")
        assert slave.messages[1] == "fmi2Instantiate: this FMU knows co-simulation and model exchange only"


def test_a_state_of_another_model_is_refused(create: Start) -> None:
    with create("lag").start() as slave, create("oscillator").start() as other:
        saved = other.save()
        content, state = other.to_bytes(saved), c_void_p()
        other.insist("fmi2FreeFMUstate", byref(saved))
        for wrong in (content, b"", content * 3):
            size = c_size_t(len(wrong))
            assert slave.call("fmi2DeSerializeFMUstate", wrong, size, byref(state)) == ERROR
        assert slave.messages[0] == "fmi2DeSerializeFMUstate: the bytes are not a state of this model"
        assert slave.messages[1].endswith("0 bytes are too few for a state of this model")
        assert slave.call("fmi2SetFMUstate", None) == ERROR


def test_a_derivative_that_is_not_a_number_is_named_with_its_time(
    create: Start,
) -> None:
    # From 1 to 0 this takes 2 - 2 ln 2 s (integrate dx / (1 + sqrt(x))).
    last = 2.0 - 2.0 * math.log(2.0)
    with create("root").start() as slave:
        slave.step(0.5)
        before = slave.get("x")
        assert slave.call("fmi2DoStep", c_double(0.5), c_double(1.0), 1) == ERROR
        message = slave.messages[0]
        assert message.startswith("fmi2DoStep: der(x) is not a finite number at t = ")
        assert float(message.split()[-2]) == pytest.approx(last, abs=1e-6)
        assert slave.get("x") == before
        slave.step(0.01)


def test_a_negative_delay_is_refused_with_its_value(create: Start) -> None:
    with create("lag").start() as slave:
        slave.set(T=-0.5)
        assert slave.call("fmi2DoStep", c_double(0.0), c_double(0.1), 1) == ERROR
        assert "delay -0.5 s at t = 0 s; it must be zero or positive" in slave.messages[0]


def test_the_last_successful_time_is_that_of_the_last_step(create: Start) -> None:
    with create("lag").start() as slave:
        slave.step(0.25)
        time = c_double()
        slave.insist("fmi2GetRealStatus", 2, byref(time))
        assert time.value == 0.25
        assert slave.call("fmi2GetRealStatus", 0, byref(time)) == DISCARD
        assert slave.call("fmi2CancelStep") == ERROR
        assert slave.call("fmi2SetDebugLogging", 1, c_size_t(0), None) == OK


def test_equal_models_give_equal_bytes(fmus: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MISFIT_CACHE", str(tmp_path / "cache"))  # so that it is compiled again
    again = build_fmu(lag(), tmp_path / "again.fmu")
    other = build_fmu(lag(constant_delay=0.2), tmp_path / "other.fmu")
    assert again.read_bytes() == fmus["lag"].read_bytes()
    guids = [fmpy.read_model_description(str(f)).guid for f in (fmus["lag"], other)]
    assert guids[0] != guids[1]


def test_names_texts_units_and_limits_survive(fmus: dict[str, Path]) -> None:
    description = fmpy.read_model_description(str(fmus["lag"]))
    by_name = {v.name: v for v in description.modelVariables}
    assert description.description == "First-order lag behind a delay, T < 1 s & more"
    assert by_name["x"].description == 'Lagged "drive"'
    assert (by_name["late"].min, by_name["late"].max) == ("-50.0", "50.0")
    assert by_name["x"].nominal == "2.0"
    assert by_name["der(x)"].unit == "N.m/s"
    assert by_name["der(x)"].derivative is by_name["x"]
    base = {unit.name: unit.baseUnit for unit in description.unitDefinitions}["N.m"]
    assert (base.kg, base.m, base.s) == (1, 2, -2)


def dependencies(fmu: Path) -> dict[str, set[str]]:
    description = fmpy.read_model_description(str(fmu))
    unknowns = [*description.outputs, *description.derivatives]
    return {u.variable.name: {v.name for v in u.dependencies} for u in unknowns}


def test_a_constant_delay_separates_output_and_input(fmus: dict[str, Path], tmp_path: Path) -> None:
    constant = build_fmu(lag(delay_is_parameter=False), tmp_path / "constant.fmu")
    assert dependencies(constant) == {"x": {"x"}, "late": set(), "der(x)": {"x"}}
    # A parameter may be set to zero, and then the input passes.
    assert dependencies(fmus["lag"]) == {
        "x": {"x"},
        "late": {"u"},
        "der(x)": {"x", "u"},
    }


def test_initial_unknowns_name_the_parameters_behind_a_start_value(
    fmus: dict[str, Path],
) -> None:
    description = fmpy.read_model_description(str(fmus["oscillator"]))
    initial = {u.variable.name: {v.name for v in u.dependencies} for u in description.initialUnknowns}
    assert initial == {
        "q": {"swing"},
        "der(q)": {"v"},
        "der(v)": {"u", "v", "w0", "D", "swing"},
    }


def test_the_sources_in_the_archive_compile_on_their_own(fmus: dict[str, Path], tmp_path: Path) -> None:
    extract_fmu(fmus["lag"], tmp_path)
    description = fmpy.read_model_description(str(fmus["lag"]))
    (file_set,) = description.buildConfigurations[0].sourceFileSets
    command = [
        "cc",
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-Wno-unused",
        "-fsyntax-only",
    ]
    subprocess.run([*command, *file_set.sourceFiles], cwd=tmp_path / "sources", check=True)


def test_extra_files_are_kept_inside_the_archive(tmp_path: Path) -> None:
    fmu = build_fmu(pendulum(), tmp_path / "p.fmu", extra_files={"resources/model.mo": b"model"})
    assert read_archive(fmu)["resources/model.mo"] == b"model"
    with pytest.raises(FmuError, match=r"'\.\./model\.mo' is not a relative path inside the archive"):
        build_fmu(pendulum(), tmp_path / "p.fmu", extra_files={"../model.mo": b"model"})
    assert [path.name for path in tmp_path.iterdir()] == ["p.fmu"]


def test_without_a_compiler_one_line_says_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CC", "no-such-compiler -O1")
    with pytest.raises(FmuError, match=r"^no C compiler found \(looked for no-such-compiler\); "):
        build_fmu(pendulum(), tmp_path / "p.fmu")
    assert list(tmp_path.iterdir()) == []


def test_the_same_sources_are_compiled_once_for_each_compiler_and_its_flags(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("MISFIT_CACHE", str(tmp_path))
    sources = {"one.c": "int one(void) { return 1; }"}
    made: list[list[str]] = []
    run = compiler.run_tool
    monkeypatch.setattr(compiler, "run_tool", lambda command, **how: made.append(list(command)) or run(command, **how))

    first, again = compiler.compile_library(sources), compiler.compile_library(sources)
    assert first == again and len(made) == 2  # compiled and linked
    monkeypatch.setenv("CFLAGS", "-O0 -g")
    assert compiler.compile_library(sources) != first
    assert [command[-6:-4] for command in made[2:3]] == [["-O0", "-g"]]


def test_an_unknown_unit_or_a_missing_value_is_named(tmp_path: Path) -> None:
    from dataclasses import replace

    parameters = (Variable("tau", "s"), Variable("T", "s", start=0.1))
    with pytest.raises(FmuError, match="parameter 'tau' has the start value None"):
        build_fmu(replace(lag(), parameters=parameters), tmp_path / "a.fmu")
    with pytest.raises(MisfitError, match="unit 'furlong': 'furlong' is not a known unit"):
        build_fmu(replace(lag(), inputs=(Variable("u", "furlong"),)), tmp_path / "a.fmu")
    with pytest.raises(FmuError, match="output 'speed' is neither a state nor an algebraic"):
        build_fmu(replace(lag(), outputs=("speed",)), tmp_path / "a.fmu")
    with pytest.raises(FmuError, match="function rhs has sizes"):
        build_fmu(replace(lag(), inputs=()), tmp_path / "a.fmu")
