"""What a model remembers from event to event, against closed forms: `pre`, `when`, `sample`, `reinit`, `edge`, `initial()`."""

import math
from pathlib import Path

import fmpy  # type: ignore[import-untyped]
import numpy as np
import pytest
from click.testing import CliRunner

from fmus.catalogue import ModelicaModel
from fmus.errors import ModelicaError
from fmus.package import build_fmu
from fmus.symbolic.store import from_bytes, to_bytes
from fmus.symbolic.system import SymbolicSystem
from orchestrator.cli.main import misfit
from orchestrator.measurements import load_measurements
from orchestrator.model_argument import load_source
from orchestrator.models.symbolic import SymbolicModel

# One model for all, as an FMU takes a second to build; its parts share nothing but the time.
MODEL = """model M
  output Real T(start=15, fixed=true) "thermostat between 19 and 21";
  Boolean on(start=true, fixed=true);
  output Real x(start=1, fixed=true) "held from sample to sample";
  discrete output Real u(start=0);
  output Real h(start=1, fixed=true) "bouncing ball";
  Real v(start=0, fixed=true);
  output Real s(start=0, fixed=true) "to and fro";
  discrete Real speed(start=3, fixed=true);
  Integer turns(start=0, fixed=true);
  output Real n = turns;
  Boolean late = time > 0.7;
  discrete output Real t0(start=-1, fixed=true) "when late became true";
  discrete output Real begun(start=0);
  discrete output Real rows[2](each start=0);
equation
  on = T < 19 or pre(on) and T < 21;
  der(T) = (if on then 5 else 0) - 0.2*(T - 10);
  when sample(0, 0.1) then
    u = -2*x;
  end when;
  der(x) = u;
  der(h) = v;
  der(v) = -9.81;
  when h < 0 then
    reinit(v, -0.8*pre(v));
  end when;
  der(s) = speed;
  when s > 0.5 then
    speed = -pre(speed);
    turns = pre(turns) + 1;
  elsewhen s < -0.5 then
    speed = 2;
    turns = pre(turns) + 10;
  end when;
  when edge(late) then
    t0 = time;
  end when;
  when {initial(), time > 1.25} then
    begun = pre(begun) + 1;
    rows = {time, 2*begun};
  end when;
end M;
"""
END = 1.5


def thermostat(t: float) -> float:
    """Up to 21 along 35 - 20 exp(-t/5), down to 19 along 10 + 11 exp(-t/5), and up again."""
    first = 5 * math.log(20 / 14)
    return 35 - 20 * math.exp(-t / 5) if t < first else 10 + 11 * math.exp(-(t - first) / 5)


def sampled(t: float) -> float:
    """x falls by a fifth from each tick to the next, along a straight line."""
    ticks = math.floor(t / 0.1 + 1e-9)
    return float(0.8**ticks * (1 - 2 * (t - 0.1 * ticks)))


def ball(t: float) -> float:
    """Each flight lasts 0.8 of the one before."""
    fall = math.sqrt(2 / 9.81)
    if t < fall:
        return 1 - 9.81 / 2 * t * t
    begin, speed = fall, 0.8 * 9.81 * fall
    while t > begin + 2 * speed / 9.81:
        begin, speed = begin + 2 * speed / 9.81, 0.8 * speed
    return speed * (t - begin) - 9.81 / 2 * (t - begin) ** 2


def to_and_fro(t: float) -> float:
    if t < 1 / 6:
        return 3 * t
    return 0.5 - 3 * (t - 1 / 6) if t < 0.5 else -0.5 + 2 * (t - 0.5) if t < 1.0 else 0.5 - 2 * (t - 1.0)


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> SymbolicSystem:
    file = tmp_path_factory.mktemp("memory") / "M.mo"
    file.write_text(MODEL)
    return from_bytes(to_bytes(ModelicaModel("M", "M", file).compile()))


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def fmu(system: SymbolicSystem, tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    return build_fmu(system, tmp_path_factory.mktemp("fmu") / "M.fmu", fmi_version=request.param)


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_events_keep_what_the_closed_forms_say(fmu: Path, kind: str) -> None:
    names = ["T", "x", "u", "h", "s", "n", "t0", "begun", "rows[1]", "rows[2]"]
    found = fmpy.simulate_fmu(
        str(fmu),
        stop_time=END,
        output_interval=0.03,
        fmi_type=kind,
        output=names[:-2] if "rows[1]" not in _names(fmu) else names,
        solver="CVode",
        relative_tolerance=1e-10,
        record_events=False,
    )
    for row in found:
        t = float(row["time"])
        near_event = min(abs(t - e) for e in (1 / 6, 0.5, 0.7, 1.0, 1.25)) < 1e-6
        assert row["T"] == pytest.approx(thermostat(t), abs=1e-5)
        assert row["x"] == pytest.approx(sampled(t), abs=1e-6)
        assert row["h"] == pytest.approx(ball(t), abs=1e-4)
        assert row["s"] == pytest.approx(to_and_fro(t), abs=1e-5)
        if not near_event:
            assert row["n"] == (t > 1 / 6) + 10 * (t > 0.5) + (t > 1.0)
            assert row["t0"] == pytest.approx(0.7 if t > 0.7 else -1.0)
            assert row["begun"] == (2 if t > 1.25 else 1)
    last = found[-1]
    assert last["u"] == pytest.approx(-2 * 0.8**15, rel=1e-6) or last["u"] == pytest.approx(-2 * 0.8**14, rel=1e-6)
    if "rows[1]" in found.dtype.names:
        assert (last["rows[1]"], last["rows[2]"]) == (pytest.approx(1.25), 4.0)


def _names(fmu: Path) -> list[str]:
    return [v.name for v in fmpy.read_model_description(str(fmu)).modelVariables]


def test_a_snapshot_holds_what_is_remembered(fmu: Path, tmp_path: Path) -> None:
    description = fmpy.read_model_description(str(fmu))
    if description.fmiVersion != "2.0":
        pytest.skip("the snapshot is the same code for both versions")
    from helpers_slave import Slave

    with Slave(fmu, tmp_path / "slave") as slave:
        slave.start()
        slave.step(0.75)
        kept = slave.save()
        ends = []
        for _ in range(2):
            slave.insist("fmi2SetFMUstate", kept)
            slave.time = 0.75
            slave.step(0.75)
            ends.append([slave.get(name) for name in ("T", "x", "h", "s", "n", "t0", "begun")])
        assert ends[0] == ends[1]


def test_a_clock_needs_no_states(tmp_path: Path) -> None:
    file = tmp_path / "M.mo"
    file.write_text(
        "model M\n  input Real w(start=1);\n  output Real u;\n  discrete Real i(start=0);\nequation\n"
        "  when sample(0.05, 0.1) then\n    i = pre(i) + 0.1*w;\n  end when;\n  u = 2*w + i;\nend M;\n"
    )
    fmu = build_fmu(ModelicaModel("M", "M", file).compile(), tmp_path / "M.fmu")
    found = fmpy.simulate_fmu(str(fmu), stop_time=1.0, output_interval=0.1, fmi_type="CoSimulation", output=["u"])
    # Ten ticks, between the communication points.
    assert found["u"] == pytest.approx(2 + 0.1 * np.arange(11))


SWITCHED = """model M
  parameter Real power = 7;
  input Real u(start=1);
  output Real x(start=0, fixed=true);
  output Real p "equals a parameter until x has reached 0.5";
  output Real q "does not read u at first";
  Boolean on(start=true, fixed=true);
equation
  when x > 0.5 then
    on = false;
  end when;
  p = if on then power else 0;
  q = if on then 0 else 3*u;
  der(x) = 1;
end M;
"""


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_what_equals_a_parameter_or_nothing_at_first_changes_at_its_event(kind: str, tmp_path: Path) -> None:
    (tmp_path / "M.mo").write_text(SWITCHED)
    fmu = build_fmu(ModelicaModel("M", "M", tmp_path / "M.mo").compile(), tmp_path / "M.fmu")
    found = fmpy.simulate_fmu(str(fmu), stop_time=1.0, output_interval=0.25, fmi_type=kind, output=["p", "q"])
    assert [found["p"][0], found["q"][0], found["p"][-1], found["q"][-1]] == pytest.approx([7, 0, 0, 3])
    description = fmpy.read_model_description(str(fmu))
    read = {each.variable.name: [v.name for v in each.dependencies] for each in description.outputs}
    assert read["q"] == ["u"]


SAMPLED = """model Furnace
  input Real set(start=0);
  output Real y(start=0, fixed=true);
  discrete Real u(start=0, fixed=true);
equation
  when sample(0, 1) then
    u = 2*(set - y);
  end when;
  der(y) = u - y;
end Furnace;
"""


def test_a_sampled_controller_ticks_while_it_is_compared_from_the_first_input_on(tmp_path: Path) -> None:
    """Its FMU has no event indicators; between ticks y goes from y0 to u by 1 - exp(-t)."""
    (tmp_path / "M.mo").write_text(SAMPLED)
    (tmp_path / "data").mkdir()
    rows, y, u, held = [], 0.0, 0.0, [3.0, 3.0, -1.0, -1.0, 4.0]
    for k in range(200):  # the set point moves between ticks, which come every fourth sample
        setting = held[(k + 2) // 40 % 5]
        u = 2 * (setting - y) if k % 4 == 0 else u
        rows.append(f"{0.25 * k},{setting},{y}\n")
        y = u + (y - u) * math.exp(-0.25)
    (tmp_path / "data" / "run.csv").write_text("time,set,y\n" + "".join(rows))
    result = tmp_path / "out.json"
    done = CliRunner().invoke(
        misfit, ["compare", f"{tmp_path}/M.mo:Furnace", str(tmp_path / "data"), "--json", str(result)]
    )
    assert done.exit_code == 0, done.output
    assert "y agrees within the noise" in result.read_text()


def written(folder: Path) -> tuple[str, str]:
    """The model's name on the command line, and data of its first output by the closed form."""
    (folder / "M.mo").write_text(MODEL)
    (folder / "data").mkdir()
    times = [0.02 * k for k in range(100)]
    (folder / "data" / "run.csv").write_text("time,T\n" + "".join(f"{t},{thermostat(t)}\n" for t in times))
    return f"{folder}/M.mo:M", str(folder / "data")


def test_comparing_runs_what_is_remembered(tmp_path: Path) -> None:
    """Evaluated as it stands, without memory, the heater would stay on beyond 21."""
    done = CliRunner().invoke(misfit, ["compare", *written(tmp_path), "--json", str(tmp_path / "out.json")])
    assert done.exit_code == 0, done.output
    assert "T agrees within the noise" in (tmp_path / "out.json").read_text()


def test_fits_refuse_what_they_would_forget(system: SymbolicSystem) -> None:
    with pytest.raises(
        ModelicaError, match=r"keeps values from event to event .*pre\(.*write it as an FMU by 'misfit build'"
    ):
        SymbolicModel("M", system)


def test_diagnosing_a_model_that_remembers_runs_it_as_an_fmu(tmp_path: Path) -> None:
    done = CliRunner().invoke(misfit, ["diagnose", *written(tmp_path), "--json", str(tmp_path / "out.json")])
    assert done.exit_code == 0, done.output
    assert '"verdict": "adequate"' in (tmp_path / "out.json").read_text()


def test_a_model_that_remembers_goes_by_its_name_and_not_by_the_place_of_its_fmu(tmp_path: Path) -> None:
    model, data = written(tmp_path)
    source = load_source(model, load_measurements(data))
    assert source.name == "M"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('y = 1 - x; when x > 1 then terminate("end"); end when;', r"M\.mo:4: terminate\(\) is not supported"),
        ("y = if initial() then 5 - x else 1 - x; initial equation der(x) = 0;", "give start values"),
    ],
)
def test_what_is_left_out_is_refused_with_a_rewrite(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "M.mo").write_text(f"model M\n  Real x; Real y;\nequation\n  der(x) = y; {text}\nend M;\n")
    with pytest.raises(ModelicaError, match=words):
        ModelicaModel("M", "M", tmp_path / "M.mo").compile()
