"""System files in TOML."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_fmus import small_fmu

from fmus.errors import MisfitError
from fmus.units import SiUnit
from orchestrator.cosim import ComponentSpec, Connection, RunSettings, System, Value
from orchestrator.cosim.connections import wire
from orchestrator.cosim.kinds import describe
from orchestrator.cosim.load import load_system
from orchestrator.cosim.toml_file import read_toml, write_toml

SHORT = """
# A plant with an effect in front of it.
[components]
plant = "plant.fmu"
lag_u = "lag_u.fmu"

[inputs]
"u" = "lag_u.u"

[outputs]
"y.1" = "plant.y.1"

[[connections]]
from = "lag_u.y"
to = "plant.u"
"""
LONG = """
name = "pair"
[run]
stop = 10
step = 1e-4
options = { extrapolation = 1 }
[components.mass]
fmu = "Mass.fmu"
step = 1e-3
isolate = true
interface = "ModelExchange"
parameters = { m = 2.5, x0 = { value = 3, unit = "mm" }, name = "heavy" }
[components.log]
kind = "player"
source = "trial.csv"
[inputs]
push = ["mass.Fa", "mass.Fb"]
[units]
push = "kN"
[[connections]]
from = "log.f"
to = "mass.Fc"
factor = 2
mapping = [[false, 0], [true, 1]]
convert = false
"""


def written(folder, text):
    path = folder / "system.toml"
    path.write_text(text)
    return path


def test_the_short_form_is_what_an_extended_fmu_is_written_as(tmp_path):
    assert load_system(written(tmp_path, SHORT)) == System(
        "system",
        {"plant": ComponentSpec("plant", source="plant.fmu"), "lag_u": ComponentSpec("lag_u", source="lag_u.fmu")},
        (Connection("lag_u.y", "plant.u"),),
        inputs={"u": ("lag_u.u",)},
        outputs={"y.1": "plant.y.1"},
        folder=tmp_path,
    )


def test_the_long_form_says_everything(tmp_path):
    mass = ComponentSpec(
        "mass",
        "fmu",
        "Mass.fmu",
        values={"m": Value(2.5), "x0": Value(3, "mm"), "name": Value("heavy")},
        step=1e-3,
        isolate=True,
        options={"interface": "ModelExchange"},
    )
    assert load_system(written(tmp_path, LONG)) == System(
        "pair",
        {"mass": mass, "log": ComponentSpec("log", "player", "trial.csv")},
        (Connection("log.f", "mass.Fc", 2.0, 0.0, ((False, 0), (True, 1)), convert=False),),
        inputs={"push": ("mass.Fa", "mass.Fb")},
        units={"push": "kN"},
        run=RunSettings(stop=10.0, step=1e-4, options={"extrapolation": 1}),
        folder=tmp_path,
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("step = 1e-4", "steps = 1e-4"), r"system.toml \[run\]: unknown key 'steps'; did you mean 'step'\?"),
        (("stop = 10", 'stop = "10"'), r"\[run\]: 'stop' = '10', expected a finite number"),
        (("isolate = true", "isolate = 1"), r"\[components\] \[mass\]: 'isolate' = 1, expected true or false"),
        (('fmu = "Mass.fmu"', 'fmx = "Mass.fmu"'), r"\[mass\]: no kind; expected one of"),
        (("interface", "interfce"), r"unknown key 'interfce'; did you mean 'interface'\?"),
        (('kind = "player"', 'kind = "plyer"'), r"\[log\]: kind = 'plyer'; did you mean 'player'\?"),
        (('from = "log.f"', 'from = "log"'), r"\[\[connections\]\] 1: 'from' = 'log', expected an address"),
        (('from = "log.f"', ""), r"\[\[connections\]\] 1: no 'from'; expected an address"),
        (("factor = 2", "factr = 2"), "unknown key 'factr'; did you mean 'factor'"),
        (("[[false, 0], [true, 1]]", "[[false, 0, 1]]"), "expected pairs of values"),
        (('unit = "mm"', "unit = 1"), "expected a value or { value"),
        (('["mass.Fa", "mass.Fb"]', '["Fa"]'), r"\[inputs\]: 'push' = 'Fa', expected an address"),
        (("[components.mass]", '[components."a.b"]'), "the component 'a.b' has a dot"),
        (("[run]", "[rnu]"), "unknown key 'rnu'; did you mean 'run'"),
    ],
)
def test_a_mistake_is_named_with_its_place_and_what_was_expected(tmp_path, change, words):
    with pytest.raises(MisfitError, match=words):
        load_system(written(tmp_path, LONG.replace(*change, 1)))


@pytest.mark.parametrize(
    ("name", "words"), [("s.txt", "ending '.txt'; expected a system file"), ("s.toml", "s.toml does not exist")]
)
def test_what_is_no_system_file_is_refused(tmp_path, name, words):
    (tmp_path / "s.txt").touch()
    with pytest.raises(MisfitError, match=words):
        load_system(tmp_path / name)


def test_one_fmu_is_a_system_with_its_inputs_and_outputs():
    path = small_fmu("mass")
    system = load_system(path)
    assert system.components == {"mass": ComponentSpec("mass", source="mass.fmu")}
    assert system.inputs == {"fa": ("mass.fa",), "fb": ("mass.fb",)}
    assert system.outputs == {"x": "mass.x", "v": "mass.v"}
    found = wire(system, {"mass": describe(system.components["mass"], system.folder)}).unconnected
    assert [str(each) for each in found] == ["input fa = 0.0 N (start value)", "input fb = 0.0 N (start value)"]


def test_a_component_may_be_a_modelica_class(tmp_path):
    system = load_system(written(tmp_path, '[components]\n[components.p]\nmodelica = "pendulum"\n'))
    spec = system.components["p"]
    assert (spec.kind, spec.options) == ("fmu", {}) and (system.folder / spec.source).is_file()
    with pytest.raises(MisfitError, match=r"\[components\] \[p\]: there is no model 'pendulumm'"):
        load_system(written(tmp_path, '[components.p]\nmodelica = "pendulumm"\n'))


def test_a_built_in_model_is_a_system_of_one():
    system = load_system("pendulum")
    assert list(system.components) == ["pendulum"]
    assert (system.folder / system.components["pendulum"].source).is_file()
    with pytest.raises(MisfitError, match="there is no model 'pendulumm'"):
        load_system("pendulumm")


NAMES = st.text(st.characters(blacklist_categories=("Cs",), blacklist_characters="."), min_size=1, max_size=8)
VALUES = st.one_of(
    st.floats(allow_nan=False),
    st.integers(-(2**63), 2**63 - 1),
    st.booleans(),
    st.text(max_size=8),
    st.lists(st.integers(-9, 9)),
)


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])  # tables of any characters take long to draw
@given(
    name=NAMES,
    component=NAMES,
    values=st.dictionaries(NAMES, st.builds(Value, VALUES, st.sampled_from(["", "mm", "N.m"])), max_size=3),
    step=st.one_of(st.none(), st.floats(1e-9, 1e9)),
    link=st.builds(
        Connection, st.just("a.y"), st.just("b.u"), st.floats(-9, 9), st.floats(-9, 9), convert=st.booleans()
    ),
)
def test_what_is_written_reads_back_the_same(tmp_path_factory, name, component, values, step, link):
    spec = ComponentSpec(component, "player", "trial.csv", values=values, step=step, isolate=False)
    run = RunSettings(stop=1.0, step=step, tolerance=1e-6, options={"order": 2})
    folder = tmp_path_factory.mktemp("systems")
    system = System(
        name, {component: spec}, (link,), {"u": ("a.u",)}, {name: "a.y"}, {"u": "mm"}, run=run, folder=folder
    )
    path = folder / "s.toml"
    path.write_text(write_toml(system), encoding="utf-8", newline="")
    assert read_toml(path) == system


def test_a_unit_that_means_something_else_is_not_lost_in_silence():
    spec = ComponentSpec("a", source="a.fmu", values={"t": Value(2.0, "t", SiUnit({"kg": 1}, 907.18474))})
    with pytest.raises(MisfitError, match="defines the unit 't' in its own way; keep it as SSP"):
        write_toml(System("s", {"a": spec}))
    metric = ComponentSpec("a", source="a.fmu", values={"t": Value(2.0, "t", SiUnit({"kg": 1}, 1000.0))})
    assert 'unit = "t"' in write_toml(System("s", {"a": metric}))
