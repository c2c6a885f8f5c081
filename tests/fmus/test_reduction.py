"""Rigid couplings: accelerations from algebra, a conserved energy, start values carried over, refusals by name."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.symbolic.system import SymbolicSystem

PARTS = """package P
  connector F Real phi; flow Real tau; end F;
  model Inertia parameter Real J = 1; F a, b; Real phi; Real w;
  equation phi = a.phi; phi = b.phi; der(phi) = w; J*der(w) = a.tau + b.tau; end Inertia;
  model Gear parameter Real n = 3; F a, b; equation a.phi = n*b.phi; 0 = n*a.tau + b.tau; end Gear;
  model Torque input Real tau; F b; equation b.tau = -tau; end Torque;
  model Damper parameter Real d = 1; F a, b; Real rel;
  equation rel = der(b.phi) - der(a.phi); b.tau = d*rel; a.tau = -b.tau; end Damper;
  model Fixed F a; equation a.phi = 0; end Fixed;
  model Geared input Real u; Torque t; Inertia i1(J=2%s); Gear g(n=%s); Inertia i2(J=5%s);
  equation t.tau = u; connect(t.b, i1.a); connect(i1.b, g.a); connect(g.b, i2.a); end Geared;
  model Damped Inertia i(J=2, w(start=1, fixed=true), phi(start=0, fixed=true)); Damper d(d=3); Fixed f;
  equation connect(f.a, d.a); connect(d.b, i.a); end Damped;
  model Pendulum parameter Real L = 1, g = 9.81; Real x(start=0.6), y(start=-0.8), vx, vy, lam;
  equation der(x) = vx; der(y) = vy; der(vx) = -lam*x; der(vy) = -lam*y - g; x^2 + y^2 = L^2; end Pendulum;
  %s
end P;
"""


def compiled(
    folder: Path, name: str, first: str = "", second: str = "", ratio: str = "3", more: str = ""
) -> SymbolicSystem:
    file = folder / "probe.mo"
    file.write_text(PARTS % (first, ratio, second, more))
    return ModelicaModel(name, f"P.{name}", file).compile()


def starts(system: SymbolicSystem) -> dict[str, float]:
    return {v.name: float(v.start or 0.0) for v in system.states}


def parameters(system: SymbolicSystem) -> list[float]:
    return [float(v.start or 0.0) for v in system.parameters]


def evaluated(system: SymbolicSystem, x: dict[str, float], u: float | None = None) -> dict[str, float]:
    dx, z = system.rhs(0, [x[v.name] for v in system.states], [] if u is None else [u], [], parameters(system))
    names = [*(f"der({v.name})" for v in system.states), *(v.name for v in system.algebraics)]
    return dict(zip(names, [*dx.full().ravel(), *z.full().ravel()], strict=True))


@pytest.mark.parametrize("ratio", [0.5, 3.0, -7.0])
def test_two_inertias_on_a_rigid_gear_share_one_acceleration(ratio: float, tmp_path: Path) -> None:
    system = compiled(tmp_path, "Geared", ratio=str(ratio))
    x = dict.fromkeys(starts(system), 0.0)

    found = evaluated(system, x, 1.7)

    # i1 turns n times as fast as i2, so i2 appears as J2/n^2 at i1.
    acceleration = 1.7 / (2 + 5 / ratio**2)
    assert len(system.states) == 2
    speed = next(name for name in x if name.endswith(".w"))
    expected = acceleration if speed == "i1.w" else acceleration / ratio
    assert found[f"der({speed})"] == pytest.approx(expected, rel=1e-12)


def test_a_start_value_of_a_variable_that_is_no_state_is_carried_over(tmp_path: Path) -> None:
    prefer = ", w(stateSelect=StateSelect.prefer), phi(stateSelect=StateSelect.prefer)"
    system = compiled(tmp_path, "Geared", prefer, ", w(start=0.2, fixed=true), phi(start=0.1, fixed=true)")

    assert starts(system) == pytest.approx({"i1.phi": 0.3, "i1.w": 0.6}, rel=1e-12)
    assert any("i2.phi, i2.w" in note for note in system.notes)


def test_start_values_that_agree_are_accepted_and_those_that_do_not_are_refused(tmp_path: Path) -> None:
    def both(w1: float) -> tuple[str, str]:
        return f", w(start={w1}, fixed=true), phi(start=0, fixed=true)", ", w(start=0.2, fixed=true)"

    assert starts(compiled(tmp_path, "Geared", *both(0.6)))["i1.w"] == pytest.approx(0.6)
    with pytest.raises(ModelicaError, match=r"probe\.mo:\d+: the fixed start value of i\d\.w contradicts"):
        compiled(tmp_path, "Geared", *both(0.7))


def test_a_declared_start_or_a_hint_decides_which_variable_stays_a_state(tmp_path: Path) -> None:
    assert "i2.w" in starts(compiled(tmp_path, "Geared", "", ", w(start=0.2), phi(start=0)"))
    assert "i2.w" in starts(compiled(tmp_path, "Geared", "", ", w(stateSelect=StateSelect.always)"))
    assert "i2.w" in starts(compiled(tmp_path, "Geared", ", w(stateSelect=StateSelect.avoid)"))


def test_a_damper_on_flanges_adds_no_state(tmp_path: Path) -> None:
    system = compiled(tmp_path, "Damped")

    assert starts(system) == {"i.phi": 0.0, "i.w": 1.0}
    assert evaluated(system, {"i.phi": 0.0, "i.w": 2.0})["der(i.w)"] == pytest.approx(-3 * 2.0 / 2)


def test_a_cartesian_pendulum_moves_like_its_angle_and_keeps_its_energy(tmp_path: Path) -> None:
    system = compiled(tmp_path, "Pendulum")
    names = [v.name for v in system.states]
    p = parameters(system)

    def run(rate, start):  # type: ignore[no-untyped-def]
        return solve_ivp(rate, (0.0, 2.0), start, rtol=1e-11, atol=1e-12).y[:, -1]

    x0 = starts(system)
    end = run(lambda t, x: system.rhs(t, x, [], [], p)[0].full().ravel(), [x0[name] for name in names])
    angle, speed = run(lambda t, q: [q[1], -9.81 * np.sin(q[0])], [np.arctan2(0.6, 0.8), 0.0])
    found = dict(zip(names, end, strict=True)) | evaluated(system, dict(zip(names, end, strict=True)))

    assert (found["x"], found["y"]) == pytest.approx((np.sin(angle), -np.cos(angle)), abs=1e-8)
    assert (found["vx"], found["vy"]) == pytest.approx((speed * np.cos(angle), speed * np.sin(angle)), abs=1e-8)
    energy = (found["vx"] ** 2 + found["vy"] ** 2) / 2 + 9.81 * found["y"]
    assert energy == pytest.approx(-9.81 * 0.8, rel=1e-9)


def test_the_derivative_of_a_multiple_of_a_state_is_the_multiple(tmp_path: Path) -> None:
    more = "model M Real x(start=1, fixed=true), y, z; equation y = 2*x; z = der(y); der(x) = -3*x; end M;"
    system = compiled(tmp_path, "M", more=more)

    assert [v.name for v in system.states] == ["x"]
    assert evaluated(system, {"x": 0.5})["z"] == pytest.approx(-3.0)


def test_differentiating_an_input_is_refused_with_its_name(tmp_path: Path) -> None:
    more = "model M input Real u; Real x, v;\n  equation\n  x = 2*u;\n  v = der(x); end M;"
    with pytest.raises(ModelicaError, match=r"^probe\.mo:18: .*the derivative of u is not known"):
        compiled(tmp_path, "M", more=more)


def test_singular_equations_are_named_with_the_unknowns_that_are_left(tmp_path: Path) -> None:
    more = "model M Real x(start=1), y, z;\n  equation\n  der(x) = -x;\n  x = 3;\n  y = x + 0*z; end M;"
    with pytest.raises(ModelicaError) as refusal:
        compiled(tmp_path, "M", more=more)

    message = str(refusal.value)
    assert "no equation is left to determine" in message
    assert "probe.mo:18, probe.mo:19" in message
    assert "determine only x" in message


def test_a_chain_of_gears_that_magnifies_rounding_is_refined(tmp_path: Path) -> None:
    more = (
        "model M input Real u; Torque t; Inertia i[5]; Gear g[4](each n=30); equation t.tau = u; connect(t.b, i[1].a);"
        "for k in 1:4 loop connect(i[k].b, g[k].a); connect(g[k].b, i[k + 1].a); end for; end M;"
    )
    system = compiled(tmp_path, "M", more=more)
    found = evaluated(system, dict.fromkeys(starts(system), 0.0), 2.0)

    acceleration = 2.0 / sum(30.0 ** (-2 * k) for k in range(5))
    assert found["der(i[1].w)"] == pytest.approx(acceleration, rel=1e-13)
    # The last inertia turns 30^4 times more slowly, and its torque is what that needs.
    assert found["i[5].a.tau"] == pytest.approx(acceleration / 30.0**4, rel=1e-9)
