"""What is checked before a system runs, and the numbers that a master gets."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from parts import Described, pair, sink, source, two

from fmus.errors import ComponentError, MisfitError
from fmus.units import SiUnit
from orchestrator.cosim import ComponentSpec, Connection, Port, System, Value
from orchestrator.cosim.connections import wire


def only_link(*parts, **keywords):
    (link,) = wire(*two(*parts, **keywords)).links
    return link


def refused(*parts, **keywords) -> str:
    with pytest.raises(MisfitError) as caught:
        wire(*two(*parts, **keywords))
    return str(caught.value)


def test_the_pair_is_wired_as_it_is_described():
    wiring = wire(*pair())
    assert [(link.source.address, link.target.address) for link in wiring.links] == [
        ("mass.x", "spring.x2"),
        ("mass.v", "spring.v2"),
        ("spring.F2", "mass.Fa"),
    ]
    assert wiring.size == 10 == len({slot.first for slot in wiring.slots})
    assert [str(each) for each in wiring.unconnected] == [
        "mass.Fb = 0.0 N (start value)",
        "spring.x1 = 0.0 m (start value)",
        "spring.v1 = 0.0 m/s (start value)",
    ]
    assert wiring.notes == ()
    assert wiring.from_component("mass") == wiring.to_component("spring") == list(wiring.links[:2])


def test_millimetres_into_metres_are_a_thousandth_and_are_listed():
    link = only_link(source(unit="mm"), sink(unit="m"))
    assert link.convert(2500.0) == 2.5
    assert wire(*two(source(unit="mm"), sink(unit="m"))).notes == ("connection a.y -> b.u: mm to m: factor 0.001",)


def test_a_force_into_a_length_is_refused():
    words = refused(source(unit="N"), sink(unit="m"))
    assert words == "connection a.y -> b.u: cannot convert 'N' (kg.m.s-2) to 'm' (m): the dimensions differ"


def test_degrees_celsius_become_kelvin_with_an_offset():
    assert only_link(source(unit="degC"), sink(unit="K")).convert(20.0) == pytest.approx(293.15, abs=1e-12)
    assert only_link(source(unit="K"), sink(unit="degC")).convert(0.0) == pytest.approx(-273.15, abs=1e-12)


def test_the_units_of_the_fmu_go_before_what_a_name_means_elsewhere():
    own = SiUnit({"m": 1}, 201.168)
    assert only_link(source(unit="furlong", si=own), sink(unit="m")).convert(10.0) == pytest.approx(2011.68, rel=1e-15)
    assert "'furlong' is not a known unit" in refused(source(unit="furlong"), sink(unit="m"))


def test_equal_names_that_two_fmus_define_differently_are_converted():
    one, other = SiUnit({"kg": 1}, 1000.0), SiUnit({"kg": 1}, 907.18474)
    link = only_link(source(unit="t", si=one), sink(unit="t", si=other))
    assert link.convert(1.0) == pytest.approx(1000 / 907.18474)


def test_hertz_and_radians_per_second_need_a_word_from_the_user():
    assert "1 Hz is 6.2832 rad/s" in refused(source(unit="Hz"), sink(unit="rad/s"))
    assert only_link(source(unit="Hz"), sink(unit="rad/s"), factor=6.25, convert=False).convert(2.0) == 12.5


def test_factor_and_offset_act_on_the_converted_value():
    assert only_link(source(unit="mm"), sink(unit="m"), factor=2.0, offset=1.0).convert(500.0) == 2.0


def test_a_missing_unit_is_taken_from_the_other_side_and_listed():
    assert wire(*two(source(), sink(unit="m"))).notes == ("connection a.y -> b.u: one side has no unit; taken as m",)


def test_a_connection_may_start_at_a_local_variable():
    """Effects beside an FMU read its speed, which tools often leave local."""
    wiring = wire(*two(Described([Port("y", "local"), Port("z", "local")]), sink()))
    assert [(link.source.address, link.target.address) for link in wiring.links] == [("a.y", "b.u")]
    assert [slot.address for slot in wiring.slots] == ["a.y", "b.u"]


@pytest.mark.parametrize(
    ("one", "other", "words"),
    [
        (source(), Described([Port("u", "output")]), "b.u is an output, but a connection ends in an input"),
        (Described([Port("y", "parameter")]), sink(), "a.y is a parameter, but a connection starts at an output"),
        (Described([Port("yy", "output")]), sink(), "a has no variable 'y'; did you mean 'yy'?"),
        (source(type="String"), sink(), "the type String does not fit Float64"),
        (source(type="Boolean"), sink(), r"say what is meant, such as mapping = [[false, 0], [true, 1]]"),
        (source(), sink(type="Int32"), "round it with a function component"),
        (source(type="Clock"), sink(type="Clock"), "expected a triggered one"),
        (source(shape=(3,)), sink(shape=(2,)), "3 values on one side, 2 values on the other"),
        (source(shape=(2, 3)), sink(shape=(3, 2)), "the shapes (2, 3) and (3, 2) differ"),
        (
            source(maximum=1.0),
            sink(minimum=2.0),
            "no value fits: the source is within [-inf, 1], the target within [2, inf]",
        ),
    ],
)
def test_what_cannot_work_is_refused_with_its_reason(one, other, words):
    assert words in refused(one, other)


def test_every_problem_is_told_at_once():
    system, parts = pair()
    wrong = (Connection("mas.x", "spring.x1"), Connection("mass.x", "spring.v1"), Connection("mass.v", "spring.v2"))
    with pytest.raises(MisfitError) as caught:
        wire(replace(system, connections=system.connections + wrong), parts)
    told = str(caught.value).split("; connection ")
    assert len(told) == 3
    assert "there is no component 'mas'; did you mean 'mass'?" in told[0]
    assert "the dimensions differ" in told[1]
    assert "already driven by connection mass.v -> spring.v2" in told[2]


def test_an_integer_that_may_not_fit_is_checked_while_running():
    link = only_link(source(type="Int32"), sink(type="UInt8"))
    assert link.convert(255) == 255 and not link.is_linear
    with pytest.raises(ComponentError, match=r"a.y = 256 does not fit b.u of type UInt8, which holds \[0, 255\]"):
        link.convert(256)
    assert only_link(source(type="Int32", minimum=0, maximum=9), sink(type="UInt8")).is_linear
    assert only_link(source(type="Int32"), sink(type="Int64")).is_linear


def test_a_mapping_translates_values_and_names_the_unknown_one():
    link = only_link(source(type="Boolean"), sink(), mapping=((False, 0.0), (True, 5.0)))
    assert [link.convert(True), link.convert(False)] == [5.0, 0.0]
    assert only_link(source(type="Int32"), sink(type="Int32"), mapping=((1, 10),)).convert(3) == 3
    link = only_link(source(type="Int32"), sink(type="Boolean"), mapping=((1, False), (2, True)))
    with pytest.raises(ComponentError, match="a.y = 3 has no counterpart in b.u; the mapping has 1, 2"):
        link.convert(3)


def test_enumerations_are_matched_by_the_names_of_their_items():
    one, other = (("off", 1), ("on", 2)), (("on", 1), ("off", 2), ("auto", 3))
    link = only_link(source(type="Enumeration", items=one), sink(type="Enumeration", items=other))
    assert [link.convert(1), link.convert(2)] == [2, 1]
    words = refused(source(type="Enumeration", items=other), sink(type="Enumeration", items=one))
    assert "has no item 'auto'" in words


def test_an_integer_may_choose_among_the_items_of_an_enumeration_only():
    link = only_link(source(type="Int32"), sink(type="Enumeration", items=(("off", 1), ("on", 2))))
    assert link.convert(2) == 2 and not link.is_linear
    with pytest.raises(ComponentError, match="a.y = 3 has no counterpart in b.u; the mapping has 1, 2"):
        link.convert(3)


def test_single_elements_of_arrays_can_be_connected():
    vector, matrix = source(shape=(4,)), sink(shape=(2, 2))
    system, parts = two(vector, matrix)
    connections = (Connection("a.y[3]", "b.u[1,2]"), Connection("a.y[4]", "b.u[1]"))
    wiring = wire(replace(system, connections=connections), parts)
    assert [(link.sources, link.targets) for link in wiring.links] == [((2,), (5,)), ((3,), (4,))]
    assert [each.address for each in wiring.unconnected] == ["b.u[3]", "b.u[4]"]
    with pytest.raises(MisfitError, match=r"a.y has shape \(4,\); there is no element \[5\], counted from 1"):
        wire(replace(system, connections=(Connection("a.y[5]", "b.u[1]"),)), parts)


def test_an_array_drives_scalars_that_bear_its_name():
    scalars = Described([Port("u[2]", "input", unit="mm"), Port("u[1]", "input", unit="m")])
    wiring = wire(*two(source(shape=(2,), unit="m"), scalars))
    assert [(link.sources, link.target.port.name, link.convert(1.0)) for link in wiring.links] == [
        ((0,), "u[1]", 1.0),
        ((1,), "u[2]", 1000.0),
    ]


def test_inputs_of_the_system_take_their_unit_from_the_first_variable_inside():
    system, parts = pair()
    system = replace(system, inputs={"push": ("mass.Fb",)}, outputs={"way": "mass.x"}, units={"way": "mm"})
    wiring = wire(system, parts)
    push, way = wiring.by_address["", "push"], wiring.by_address["", "way"]
    assert (push.port.causality, push.port.unit) == ("output", "N")
    assert [link.source.address for link in wiring.to_component("")] == ["mass.x"]
    assert wiring.to_component("")[0].convert(0.5) == 500.0
    assert way.port.unit == "mm"
    addresses = [each.address for each in wiring.unconnected]
    assert "mass.Fb" not in addresses and "input push" in addresses


def test_an_input_of_the_system_starts_where_the_variable_inside_does():
    system, parts = pair()
    system = replace(system, inputs={"push": ("mass.Fb",)}, units={"push": "kN"}).with_values({"mass.Fb": Value(250.0)})
    wiring = wire(system, parts)
    assert wiring.by_address["", "push"].port.start == pytest.approx(0.25)
    assert str(wiring.unconnected[0]) == "input push = 0.25 kN (given)"
    assert wiring.from_component("")[0].source is wiring.by_address["", "push"]


def test_an_input_of_the_system_can_be_given_in_its_unit():
    system, parts = pair()
    system = replace(system, inputs={"push": ("mass.Fa", "mass.Fb")}, units={"push": "kN"}, connections=())
    assert wire(system.with_values({"push": Value(2.0)}), parts).starts["mass"] == {"Fa": 2000.0, "Fb": 2000.0}
    assert wire(system.with_values({"push": Value("5 N")}), parts).starts["mass"] == {"Fa": 5.0, "Fb": 5.0}


def test_a_unit_is_named_for_a_variable_without_one_and_must_not_contradict_the_component():
    named = Described([Port("y", "output")])
    system, parts = two(named, sink(unit="m"))
    components = {**system.components, "a": ComponentSpec("a", units={"y": "mm"})}
    assert wire(replace(system, components=components), parts).links[0].convert(1.0) == 0.001
    components["b"] = ComponentSpec("b", units={"u": "km", "v": "m"})
    with pytest.raises(
        MisfitError, match="b.u is in m, but the system says km; unit of b.v: there is no such variable"
    ):
        wire(replace(system, components=components), parts)


def test_given_values_are_converted_to_the_unit_of_the_variable():
    system, parts = pair()
    values = {"spring.k": Value(5, "N/mm"), "mass.m": Value("250 g"), "mass.Fb": Value("-1.5")}
    wiring = wire(system.with_values(values), parts)
    assert wiring.starts == {"mass": {"m": 0.25, "Fb": -1.5}, "spring": {"k": 5000.0}}
    assert str(wiring.unconnected[0]) == "mass.Fb = -1.5 N (given)"


@pytest.mark.parametrize(
    ("address", "value", "words"),
    [
        ("mass.m", Value(-1.0), r"mass.m: m = -1 kg is outside \[0, inf\] kg"),
        ("mass.m", Value(-1.0, "g"), r"m = -0.001 kg \(given as -1 g\) is outside"),
        ("mass.m", Value(1.0, "m"), "m is in kg: cannot convert 'm'"),
        ("mass.m", Value("heavy"), "m = 'heavy' is not of the type Float64"),
        ("mass.m", Value(True), "m = True is not of the type Float64"),
        ("mass.m", Value(float("nan")), "m = nan is not of the type Float64"),
        ("mass.x", Value(1.0), r"x is computed by the component \(causality output\)"),
        ("mass.mm", Value(1.0), "mass has no variable 'mm'; did you mean 'm'?"),
    ],
)
def test_a_value_that_cannot_be_set_says_why(address, value, words):
    system, parts = pair()
    with pytest.raises(MisfitError, match=words):
        wire(system.with_values({address: value}), parts)


def test_values_of_arrays_enumerations_and_other_types_are_read():
    ports = [
        Port("q", "parameter", shape=(2, 2), unit="m", start=np.zeros((2, 2))),
        Port("mode", "parameter", type="Enumeration", items=(("slow", 1), ("fast", 2))),
        Port("n", "parameter", type="Int32"),
        Port("on", "parameter", type="Boolean"),
        Port("blob", "parameter", type="Binary"),
        Port("text", "parameter", type="String"),
    ]
    values = {
        "q": Value([[1, 2], [3, 4]], "mm"),
        "q[4]": Value(9.0),
        "mode": Value("fast"),
        "n": Value("3"),
        "on": Value("true"),
        "blob": Value("0aff"),
        "text": Value("2.5"),
    }
    system = System("s", {"c": ComponentSpec("c", values=values)})
    starts = wire(system, {"c": Described(ports)}).starts["c"]
    assert np.array_equal(starts.pop("q"), [[0.001, 0.002], [0.003, 9.0]])
    assert starts == {"mode": 2, "n": 3, "on": True, "blob": b"\n\xff", "text": "2.5"}


NAMES = st.sampled_from(["m", "mm", "km", "cm", "in"])
DEFINED = {"in": SiUnit({"m": 1}, 0.0254)}


@given(chain=st.lists(NAMES, min_size=2, max_size=5), value=st.floats(-1e6, 1e6))
def test_a_chain_of_conversions_is_the_direct_one(chain, value):
    through = value
    for one, other in zip(chain, chain[1:], strict=False):
        through = only_link(source(unit=one, si=DEFINED.get(one)), sink(unit=other, si=DEFINED.get(other))).convert(
            through
        )
    ends = source(unit=chain[0], si=DEFINED.get(chain[0])), sink(unit=chain[-1], si=DEFINED.get(chain[-1]))
    assert through == pytest.approx(only_link(*ends).convert(value), rel=1e-12, abs=1e-300)


@given(sizes=st.lists(st.integers(1, 4), min_size=1, max_size=6), data=st.data())
def test_each_value_has_its_own_number_and_links_copy_what_they_name(sizes, data):
    parts = {
        f"c{k}": Described([Port("y", "output", shape=(n,)), Port("u", "input", shape=(n,))])
        for k, n in enumerate(sizes)
    }
    ends = [(k, i) for k, n in enumerate(sizes) for i in range(1, n + 1)]
    targets = data.draw(st.lists(st.sampled_from(ends), unique=True))
    sources = [data.draw(st.sampled_from(ends)) for _ in targets]
    connections = tuple(
        Connection(f"c{k}.y[{i}]", f"c{m}.u[{j}]") for (k, i), (m, j) in zip(sources, targets, strict=True)
    )
    wiring = wire(System("s", {name: ComponentSpec(name) for name in parts}, connections), parts)
    assert wiring.size == 2 * sum(sizes)
    names = {slot.first + k: f"{slot.component}.{e}" for slot in wiring.slots for k, e in enumerate(slot.port.elements)}
    assert len(names) == wiring.size
    copied = [(names[s], names[t]) for link in wiring.links for s, t in zip(link.sources, link.targets, strict=True)]
    assert copied == [(c.source, c.target) for c in connections]
    free = {each.address for each in wiring.unconnected if "[" in each.address} | {
        f"{each.address}[{k + 1}]"
        for each in wiring.unconnected
        if "[" not in each.address
        for k in range(np.size(each.value))
    }
    assert free == {f"c{k}.u[{i}]" for k, i in ends} - {c.target for c in connections}
