"""One FMU in place of another: the report, and the system with the new one."""

import json
from dataclasses import replace

import numpy as np
import pytest
from parts import MASS, SPRING, Described
from small_fmus import small_fmu

from fmus.errors import MisfitError
from fmus.units import SiUnit
from orchestrator.cosim import ComponentSpec, Connection, Port, RunSettings, System, Value
from orchestrator.cosim.connections import wire
from orchestrator.cosim.kinds import describe
from orchestrator.cosim.swap import Side, compare_interfaces, mapping_text, read_mapping, swap


def side(described: Described, name: str = "new.fmu", **changes) -> Side:
    """A side with some ports changed: None takes a port out, a dict changes it."""
    ports = []
    for port in described.ports:
        change = changes.get(port.name, {})
        if change is not None:
            ports.append(replace(port, **change))
    return Side(name, ports, described.feedthrough)


USED = {"x": "drives spring.x2", "v": "drives spring.v2", "Fa": "driven by spring.F2", "m": "set to a value"}


def of_mass(names=None, used=USED, **changes):
    return compare_interfaces("mass", side(MASS, "old.fmu"), side(MASS, **changes), used, names)


def test_the_same_interface_matches_without_a_word():
    report = of_mass()
    assert report.works and not report.questions and not report.missing and not report.added
    assert [(match.old, match.new, match.how, match.conversion) for match in report.matches] == [
        (name, name, "same name", "") for name in ("Fa", "Fb", "x", "v", "m")
    ]
    assert "5 of 5 variables match by name, 4 of them in use" in str(report)


def test_another_unit_is_converted_and_told_in_the_direction_of_the_signal():
    report = of_mass(x={"unit": "mm"}, Fa={"unit": "kN"})
    assert report.works
    found = {match.old: match.conversion for match in report.matches}
    assert (found["x"], found["Fa"], found["v"]) == ("mm to m: factor 0.001", "N to kN: factor 0.001", "")


def test_another_dimension_under_the_same_name_cannot_work():
    report = of_mass(x={"unit": "N"})
    assert report.problems == (
        "output 'x' and output 'x' of new.fmu: cannot convert 'N' (kg.m.s-2) to 'm' (m): the dimensions differ (drives spring.x2)",
    )
    assert of_mass(x={"unit": "N"}, used={}).works


def test_a_missing_variable_matters_only_if_it_is_used():
    assert of_mass(Fb=None).works
    assert of_mass(Fb=None).missing == (("Fb", "input", "N", ""),)
    report = of_mass(v=None)
    assert report.problems == ("new.fmu has no output 'v' (drives spring.v2); nor any other output",)


def test_a_similar_name_of_the_same_dimension_is_a_question():
    report = of_mass(x={"name": "x_pos"}, v={"name": "speed"})
    assert [(match.old, match.new) for match in report.questions] == []
    report = of_mass(Fa={"name": "F_a"}, Fb={"name": "load"})
    assert [(match.old, match.new) for match in report.questions] == [("Fa", "F_a")]
    assert report.works


def test_two_names_that_are_as_similar_are_not_guessed():
    changed = side(MASS, Fa={"name": "F1"}, Fb={"name": "F2"})
    report = compare_interfaces("mass", side(MASS), changed, {"Fa": "driven by spring.F2"})
    assert not report.questions
    assert "has no input 'Fa'" in report.problems[0] and "give its name in a mapping file" in report.problems[0]


def test_a_similar_name_of_another_dimension_is_not_proposed():
    report = of_mass(v={"name": "v_", "unit": "m"})
    assert not report.questions and not report.works


def test_a_mapping_renames_and_leaves_out():
    report = of_mass({"x": "position", "m": ""}, x={"name": "position", "unit": "mm"}, m=None)
    assert report.works
    renamed = next(match for match in report.matches if match.old == "x")
    assert (renamed.new, renamed.how, renamed.conversion) == ("position", "mapping", "mm to m: factor 0.001")
    report = of_mass({"y": "x", "x": "xx"})
    assert "the mapping names 'y', which old.fmu does not have" in report.problems[0]
    assert "the mapping of 'x': new.fmu has no variable 'xx'; did you mean 'x'?" in report.problems[1]


def test_another_causality_cannot_work():
    assert "the causality input is not parameter" in of_mass(Fa={"causality": "parameter"}).problems[0]


def test_other_default_values_are_listed_in_comparable_units():
    report = of_mass(m={"start": 1000.0, "unit": "g", "si": SiUnit({"kg": 1}, 0.001)}, Fb={"start": 2.0})
    assert [(each.what, each.old, each.new) for each in report.parameters] == [("Fb", "0 N", "2 N")]


def test_an_array_takes_the_place_of_scalars_that_bear_its_name():
    u = Port("u", "input")
    scalars = Described([*(Port(f"q[{k}]", "output", unit="rad") for k in (1, 2)), u], {"q[1]": (), "q[2]": ()})
    array = Described([Port("q", "output", shape=(2,), unit="rad"), u], {"q": ()})
    report = compare_interfaces("c", side(scalars), side(array), {"q[1]": "recorded"})
    assert [match.new for match in report.matches] == ["q[1]", "q[2]", "u"] and report.works and not report.added
    assert not report.notes
    back = compare_interfaces("c", side(array), side(scalars), {"q[2]": "recorded"})
    assert [(match.old, match.new, match.use) for match in back.matches[:1]] == [("q", "q", "recorded")]
    assert back.works and not back.notes


def test_a_new_dependency_of_an_output_is_told():
    more = {**SPRING.feedthrough, "F1": ("x1", "v1", "x2", "v2")}
    old = Side("old", SPRING.ports, {**SPRING.feedthrough, "F1": ("x1", "v1")})
    report = compare_interfaces("s", old, Side("new", SPRING.ports, more), {"F1": "recorded", "x2": "driven by mass.x"})
    assert report.notes == ("F1 depends on x2 without a delay now, which it did not before",)


def pair(folder, **settings) -> System:
    for name in ("mass", "spring"):
        (folder / f"{name}.fmu").write_bytes(small_fmu(name).read_bytes())
    mass = ComponentSpec("mass", source="mass.fmu", values={"x0": Value(0.5), "m": Value(2000.0, "g")})
    return System(
        "pair",
        {"mass": mass, "spring": ComponentSpec("spring", source="spring.fmu")},
        (
            Connection("mass.x", "spring.x2"),
            Connection("mass.v", "spring.v2", 3.0, 0.25, convert=False),
            Connection("spring.f2", "mass.fa"),
        ),
        outputs={"way": "mass.x"},
        run=RunSettings(step=1e-3, **settings),
        folder=folder,
    )


def wired(system: System):
    return wire(system, {name: describe(spec, system.folder) for name, spec in system.components.items()})


MILLIMETRES = {
    '<Unit name="m"><BaseUnit m="1" kg="0" s="0"/></Unit>': '<Unit name="m"><BaseUnit m="1" factor="0.001"/></Unit>',
    '<Unit name="m/s"><BaseUnit m="1" kg="0" s="-1"/></Unit>': '<Unit name="m/s"><BaseUnit m="1" s="-1" factor="0.001"/></Unit>',
    'name="x"': 'name="pos_x"',
}


def test_values_and_connections_keep_their_meaning(tmp_path):
    """The new mass counts in thousandths under the old names of units, and calls x pos_x."""
    other = small_fmu("mass", replace=MILLIMETRES)
    system = pair(tmp_path)
    found = swap(system, "mass", other, {"x": "pos_x"})
    assert found.report.works and found.system is not None
    wiring = wired(found.system)
    assert wiring.starts["mass"] == {"x0": pytest.approx(500.0), "m": pytest.approx(2.0)}
    links = {link.target.address: link for link in wiring.links}
    assert links["spring.x2"].convert(1500.0) == pytest.approx(1.5)
    assert links["spring.v2"].convert(2000.0) == pytest.approx(3 * 2.0 + 0.25)
    assert found.system.outputs == {"way": "mass.pos_x"}


def test_a_swap_for_the_same_fmu_in_another_version_changes_nothing_but_the_version(tmp_path):
    found = swap(pair(tmp_path), "mass", small_fmu("mass", 3))
    assert found.report.works and not found.report.questions
    assert [(each.old, each.new) for each in found.report.capabilities if each.what == "FMI version"] == [("2", "3")]
    assert wired(found.system).notes == wired(pair(tmp_path)).notes


def test_a_swap_that_lacks_an_ability_says_so_before_running(tmp_path):
    poor = small_fmu("mass", replace={' canGetAndSetFMUstate="true"': ""}, interfaces=["CoSimulation"])
    found = swap(pair(tmp_path, master="iterative"), "mass", poor)
    assert found.system is None
    assert found.report.problems == ("it cannot keep its state, which the iterative master needs to take steps back",)
    assert swap(pair(tmp_path), "mass", poor).system is not None


def test_a_swap_for_something_else_says_everything_that_is_missing(tmp_path):
    found = swap(pair(tmp_path), "mass", small_fmu("gain"), recorded=["v"])
    assert found.system is None and not found.report.works
    told = " ".join(found.report.problems)
    assert all(f"{name!r}" in told for name in ("x", "v", "fa", "x0", "m"))
    assert "drives spring.v2, recorded" in told


def test_a_loop_that_the_swap_closes_is_named(tmp_path):
    (tmp_path / "stair.fmu").write_bytes(small_fmu("decay").read_bytes())
    (tmp_path / "gain.fmu").write_bytes(small_fmu("gain").read_bytes())
    components = {"a": ComponentSpec("a", source="stair.fmu"), "b": ComponentSpec("b", source="gain.fmu")}
    links = (Connection("a.x", "b.u"), Connection("b.y", "a.u"))
    found = swap(System("loop", components, links, folder=tmp_path), "a", small_fmu("gain"), {"x": "y"})
    assert "y depends on u without a delay now, which it did not before" in found.report.notes
    (told,) = [note for note in found.report.notes if "algebraic loop" in note]
    assert all(end in told for end in ("a.y -> b.u", "b.y -> a.u"))


def test_the_report_is_plain_data_and_a_mapping_file_can_be_made_of_it(tmp_path):
    report = of_mass(Fa={"name": "F_a"}, v=None)
    data = json.loads(json.dumps(report.to_json()))
    assert data["schema"] == "misfit.swap/1" and data["works"] is False
    assert {match["how"] for match in data["matched"]} == {"same name", "similar"}
    path = tmp_path / "names.toml"
    path.write_text(mapping_text(report))
    assert read_mapping(path, "mass") == {"Fa": "F_a", "v": ""}
    assert read_mapping(path, "spring") == {}
    again = of_mass(read_mapping(path, "mass"), Fa={"name": "F_a"}, v=None)
    assert again.works and not again.questions
    path.write_text('Fa = "F_a"')
    with pytest.raises(MisfitError, match="expected a table for each component"):
        read_mapping(path, "mass")


def test_what_is_not_there_is_named(tmp_path):
    with pytest.raises(MisfitError, match="has no component 'mas'"):
        swap(pair(tmp_path), "mas", small_fmu("mass"))
    with pytest.raises(MisfitError, match="expected an FMU to swap in for 'mass'"):
        swap(pair(tmp_path), "mass", tmp_path / "none.fmu")


def test_elements_of_arrays_follow_their_array(tmp_path):
    (tmp_path / "s.fmu").write_bytes(small_fmu("statespace", 3).read_bytes())
    components = {name: ComponentSpec(name, source="s.fmu", values={"x0": Value([1.0, 2.0, 3.0])}) for name in "ab"}
    system = System("arrays", components, (Connection("a.y[2]", "b.u[1]"),), folder=tmp_path)
    other = small_fmu("statespace", 3, replace={'name="y"': 'name="out"'})
    found = swap(system, "a", other, {"y": "out"})
    assert found.system.connections == (Connection("a.out[2]", "b.u[1]"),)
    assert np.array_equal(wired(found.system).starts["a"]["x0"], [1.0, 2.0, 3.0])


def test_whole_numbers_do_not_take_the_place_of_a_quantity_with_a_unit():
    """An Integer of FMI 2 has no unit: 3 may be newtons, or counts of something."""
    report = of_mass(x={"type": "Int32", "unit": ""})
    assert "it is Float64 in m, the new one is Int32, which has whole numbers and no unit" in report.problems[0]
    assert of_mass(x={"type": "Int32", "unit": ""}, used={}).works


def test_a_refusal_gives_each_side_its_own_unit_and_none_where_there_is_none():
    report = of_mass(Fa={"unit": "", "minimum": 5.0, "maximum": 6.0}, x={"minimum": 1.0})
    assert report.works
    old, new = side(MASS, "old.fmu", Fa={"unit": "", "maximum": 1.0}), side(MASS, Fa={"minimum": 2.0})
    problem = compare_interfaces("mass", old, new, USED).problems[0]
    assert "the source is within [-inf, 1], the target within [2, inf] N" in problem


@pytest.mark.parametrize(
    ("run", "words"),
    [
        (RunSettings(stop=1.0, step=0.3), "the run of 1 s ends in the middle of a step of 0.3 s"),
        (RunSettings(stop=1.0, step=0.1, master="adaptive"), "the adaptive master chooses their size"),
        (RunSettings(stop=1.0, step=0.1), ""),
    ],
)
def test_an_fmu_of_one_step_size_is_refused_where_the_run_asks_for_others(tmp_path, run, words):
    rigid = small_fmu(
        "mass", replace={' canHandleVariableCommunicationStepSize="true"': ""}, interfaces=["CoSimulation"]
    )
    found = swap(replace(pair(tmp_path), run=run), "mass", rigid)
    if words:
        assert found.system is None and any(words in problem for problem in found.report.problems)
    else:
        assert found.system is not None and "steps of one size only" in found.report.notes[0]


def test_an_fmu_with_a_fixed_step_of_its_own_is_refused_unless_the_old_one_had_it_too(tmp_path):
    steady = small_fmu(
        "mass", 3, replace={"canHandle": 'fixedInternalStepSize="0.03" canHandle'}, interfaces=["CoSimulation"]
    )
    before = replace(pair(tmp_path), run=RunSettings(stop=1.0, step=0.01))
    refused = swap(before, "mass", steady)
    assert refused.report.problems == ("it steps by 0.03 s only, and the system asks for 0.01 s",)

    parts = {**before.components, "mass": replace(before.components["mass"], source=str(steady))}
    assert swap(replace(before, components=parts), "mass", steady).system is not None
