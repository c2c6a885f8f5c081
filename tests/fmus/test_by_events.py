"""Models whose relations have to take sides one after the other: friction that sticks and ideal diodes, against closed forms."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import fmpy  # type: ignore[import-untyped]
import numpy as np
import pytest

from fmus.frontend.compile import compile_class
from fmus.package import build_fmu
from fmus.symbolic import build, events
from fmus.symbolic.system import Relations, SymbolicSystem
from fmus.symbolic.verify import TranslationError

# The friction of the Modelica Standard Library (PartialFriction), 1.1 at rest and 1 in motion, on a mass of 2 pushed by 3 sin(t).
FRICTION = """model M
  parameter Real tau0 = 1, tau0_max = 1.1;
  output Real w(start=0, fixed=true);
  Real a, sa, tau;
  Boolean startForward(start=false, fixed=true), startBackward(start=false, fixed=true), locked(start=false);
  constant Integer Unknown=3, Forward=1, Stuck=0, Backward=-1;
  Integer mode(final min=Backward, final max=Unknown, start=Unknown, fixed=true);
equation
  startForward = pre(mode) == Stuck and (sa > tau0_max or pre(startForward) and sa > tau0) or initial() and w > 0;
  startBackward = pre(mode) == Stuck and (sa < -tau0_max or pre(startBackward) and sa < -tau0) or initial() and w < 0;
  locked = not (pre(mode) == Forward or startForward or pre(mode) == Backward or startBackward);
  a = if locked then 0 else if startForward then sa - tau0_max else if startBackward then sa + tau0_max
    else if pre(mode) == Forward then sa - tau0_max else sa + tau0_max;
  mode = if (pre(mode) == Forward or startForward) and w > 0 then Forward
    else if (pre(mode) == Backward or startBackward) and w < 0 then Backward else Stuck;
  tau = if locked then sa else if startForward then tau0_max else if startBackward then -tau0_max
    else if pre(mode) == Forward then tau0 else -tau0;
  a = der(w);
  2*a = 3*sin(time) - tau;
end M;
"""
# The ideal diode of the library behind a voltage of 10 sin(6 t) and 10 Ohm.
DIODE = """model M
  parameter Real Ron = 1e-5, Goff = 1e-5;
  Boolean off(start=true);
  Real s;
  output Real v, i;
  output Real charge(start=0, fixed=true);
equation
  off = s < 0;
  v = s*(if off then 1 else Ron);
  i = s*(if off then Goff else 1);
  10*sin(6*time) = 10*i + v;
  der(charge) = i;
end M;
"""


@pytest.fixture
def by_events(monkeypatch: pytest.MonkeyPatch) -> None:
    """The way that is taken where the equations with their relations as they stand cannot be checked."""

    def refused(_: SymbolicSystem) -> None:
        raise TranslationError("several solutions")

    monkeypatch.setattr(build, "verify_relations", refused)


def _compiled(text: str, folder: Path) -> SymbolicSystem:
    (folder / "M.mo").write_text(text)
    return build.build_system(compile_class("M", folder / "M.mo"), "M")


@pytest.mark.usefixtures("by_events")
def test_friction_that_sticks_starts_and_stops_as_the_closed_form_says(tmp_path: Path) -> None:
    system = _compiled(FRICTION, tmp_path)
    assert system.remembers and not [note for note in system.notes if "not checked" in note]
    fmu = build_fmu(system, tmp_path / "M.fmu")
    found = fmpy.simulate_fmu(str(fmu), stop_time=2.8, output_interval=0.05, relative_tolerance=1e-9, solver="CVode")
    begin = math.asin(1.1 / 3)
    t = np.maximum(found["time"], begin)
    assert found["w"] == pytest.approx((3 * (math.cos(begin) - np.cos(t)) - (t - begin)) / 2, abs=1e-6)


@pytest.mark.parametrize("start", [-10.0, 10.0])
def test_friction_that_slides_when_a_run_begins_acts_against_the_motion(start: float, tmp_path: Path) -> None:
    """The variable that asks initial() is one that another discrete variable asks for."""
    system = _compiled(FRICTION.replace("w(start=0", f"w(start={start}"), tmp_path)
    fmu = build_fmu(system, tmp_path / "M.fmu")
    found = fmpy.simulate_fmu(str(fmu), stop_time=1.0, output_interval=0.05, relative_tolerance=1e-9, solver="CVode")
    t = found["time"]
    assert found["w"] == pytest.approx(start + (3 * (1 - np.cos(t)) - math.copysign(1.0, start) * t) / 2, abs=1e-6)


@pytest.mark.usefixtures("by_events")
def test_an_ideal_diode_conducts_one_way(tmp_path: Path) -> None:
    system = _compiled(DIODE, tmp_path)
    assert system.remembers
    fmu = build_fmu(system, tmp_path / "M.fmu")
    found = fmpy.simulate_fmu(str(fmu), stop_time=2.0, output_interval=0.03, relative_tolerance=1e-9, solver="CVode")
    u = 10 * np.sin(6 * found["time"])
    assert found["i"] == pytest.approx(np.where(u > 0, u / (10 + 1e-5), u * 1e-5 / (1 + 1e-4)), abs=1e-9)


@pytest.mark.usefixtures("by_events")
def test_an_equation_that_does_not_hold_after_its_events_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = events.RelationRecorder.relations

    def wrong(*arguments: Any) -> Relations:
        relations = right(*arguments)
        places = [ca.SX.sym("a", relations.rhs.numel_in(k)) for k in range(relations.rhs.n_in())]
        *others, last = relations.rhs.call(places)
        return replace(relations, rhs=ca.Function("rhs", places, [*others, 1.001 * last]))

    monkeypatch.setattr(events.RelationRecorder, "relations", wrong)
    with pytest.raises(TranslationError, match="several solutions"):
        _compiled(DIODE, tmp_path)
