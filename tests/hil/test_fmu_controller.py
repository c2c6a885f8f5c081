"""A controller that is an FMU holds the arm as its equations say, and replays bit for bit."""

from pathlib import Path

import numpy as np
import pytest

from fmus.errors import MisfitError
from hil.control.controllers import Observed
from hil.control.pilot import Pilot
from hil.emulation.fmu_controller import FmuController
from hil.recording.recorder import Recorder
from hil.recording.replay import replay
from hil.session.loop import Loop, Wishes
from hil.settings import read_settings
from tests.hil.bench import Bench, ExactTimer

SPRING = """model Spring "A spring with an integral part on the third joint"
  parameter Real stiffness(unit="N.m/rad") = 20;
  parameter Real damping(unit="N.m.s/rad") = 1;
  parameter Real gain(unit="N.m/(rad.s)") = 30;
  parameter Real posture(unit="rad") = 1.4;
  input Real q3(unit="rad", start=0);
  input Real w3(unit="rad/s", start=0);
  output Real tau3(unit="N.m");
  Real sum(unit="rad.s", start=0, fixed=true);
equation
  der(sum) = posture - q3;
  tau3 = stiffness*(posture - q3) - damping*w3 + gain*sum;
end Spring;
"""
SILENT = """model Silent "It says nothing of torques"
  input Real q1(start=0);
  output Real y;
equation
  y = q1;
end Silent;
"""


@pytest.fixture(scope="module")
def spring(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("controller") / "Spring.mo"
    path.write_text(SPRING)
    return f"{path}:Spring"


def test_an_fmu_gives_the_torque_of_its_equations(spring: str) -> None:
    controller, zeros = FmuController(spring), (0.0, 0.0, 0.0)

    def torque(seconds: float, q3: float) -> np.ndarray:
        return controller.torque(Observed(seconds, (0.0, 0.0, q3), (0.0, 0.0, 0.5), zeros))

    assert torque(-1.0, 1.0).tolist() == [0.0, 0.0, 0.0]
    assert torque(0.0, 1.0) == pytest.approx([0.0, 0.0, 20 * 0.4 - 0.5])
    # 0.4 rad for a tenth of a second is in the integral by then
    assert torque(0.1, 1.2) == pytest.approx([0.0, 0.0, 20 * 0.2 - 0.5 + 30 * 0.04])


def test_an_arm_that_an_fmu_holds_goes_where_it_says_and_replays(spring: str, tmp_path: Path) -> None:
    bench = Bench()
    bench.plant.outside = np.array(
        [0.0, 0.0, 0.15]
    )  # which the integral part makes up for; more would look like a runaway
    pilot, recorder = bench.pilot(FmuController(spring)), Recorder(tmp_path / "session")
    bench.wire.tap = recorder.frame
    cycles = iter(range(10_000))
    loop = Loop(bench.wire, pilot, ExactTimer(bench), recorder)
    summary = loop.run(lambda: Wishes(arm=not pilot.is_armed, over=next(cycles) > 2500))
    recorder.finish()
    assert summary.faults == []
    again = Pilot(pilot.robot, pilot.limits, FmuController(spring), gravity=False)
    decisions = [(found, decision) for found, _, decision in replay(tmp_path / "session", again)]
    assert decisions[-1][0].first_different is None
    # before the arm is let down
    assert decisions[2400][1].observed.angles[2] == pytest.approx(1.4, abs=0.02)


def test_settings_name_an_fmu_as_controller(spring: str, tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(f'[controller]\nkind = "fmu"\nsource = "{spring}"\n')
    assert isinstance(read_settings(path).make_controller(), FmuController)
    path.write_text('[controller]\nkind = "fmu"\n')
    with pytest.raises(MisfitError, match="source"):
        read_settings(path).make_controller()


def test_an_fmu_with_other_ports_is_refused_by_them(tmp_path: Path) -> None:
    path = tmp_path / "Silent.mo"
    path.write_text(SILENT)
    with pytest.raises(MisfitError, match="drive: input torque is none of a controller's"):
        FmuController("drive")
    with pytest.raises(MisfitError, match="Silent has none of the outputs tau1"):
        FmuController(f"{path}:Silent")
