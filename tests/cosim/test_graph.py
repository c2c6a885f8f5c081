"""The order of evaluation at one instant, and the loops that have none."""

from hypothesis import given
from hypothesis import strategies as st
from parts import Described, pair

from orchestrator.cosim import ComponentSpec, Connection, Port, System
from orchestrator.cosim.connections import wire
from orchestrator.cosim.graph import Loop, Read, forced_delay, plan, without_feedthrough


def block(inputs: int, outputs: int, through: dict[str, tuple[str, ...]] | None = None) -> Described:
    ports = [Port(f"u{k}", "input") for k in range(inputs)] + [Port(f"y{k}", "output") for k in range(outputs)]
    return Described(ports, {} if through is None else through)


def planned(parts: dict[str, Described], *ends: tuple[str, str]):
    system = System("s", {name: ComponentSpec(name) for name in parts}, tuple(Connection(*each) for each in ends))
    wiring = wire(system, parts)
    return plan(wiring, {name: part.feedthrough for name, part in parts.items()}), wiring


def test_the_mass_is_read_before_the_spring_that_it_moves():
    system, parts = pair()
    steps = plan(wire(system, parts), {name: part.feedthrough for name, part in parts.items()})
    assert steps == (Read("mass", ("x", "v")), Read("spring", ("F2",)))


def test_an_output_is_read_for_the_record_although_it_drives_nothing():
    system, parts = pair()
    feedthrough = {name: part.feedthrough for name, part in parts.items()}
    steps = plan(wire(system, parts), feedthrough, wanted=[("spring", "F1")])
    assert steps == (Read("mass", ("x", "v")), Read("spring", ("F2", "F1")))


def test_a_component_between_two_others_is_read_twice_only_where_it_must_be():
    through = {"y0": (), "y1": ("u0",)}
    parts = {"a": block(1, 2, through), "b": block(1, 1), "c": block(1, 0)}
    steps, _ = planned(parts, ("a.y0", "b.u0"), ("b.y0", "a.u0"), ("a.y1", "c.u0"))
    assert steps == (Read("a", ("y0",)), Read("b", ("y0",)), Read("a", ("y1",)))
    steps, _ = planned({**parts, "b": block(1, 1, {"y0": ()})}, ("a.y0", "b.u0"), ("b.y0", "a.u0"), ("a.y1", "c.u0"))
    assert steps == (Read("b", ("y0",)), Read("a", ("y0", "y1")))


def test_two_blocks_in_a_circle_are_a_loop_with_a_name_and_one_guessed_value():
    steps, _ = planned({"a": block(1, 1), "b": block(1, 1)}, ("a.y0", "b.u0"), ("b.y0", "a.u0"))
    (loop,) = steps
    assert isinstance(loop, Loop)
    assert len(loop.tears) == 1 and loop.tears[0] in {("a", "u0"), ("b", "u0")}
    assert str(loop).count("->") == 4 and loop.path[0] == loop.path[-1]
    torn = loop.tears[0][0]
    other = {"a": "b", "b": "a"}[torn]
    assert loop.reads == (Read(torn, ("y0",)), Read(other, ("y0",)))


def test_a_block_that_feeds_itself_is_a_loop():
    steps, _ = planned({"a": block(1, 1)}, ("a.y0", "a.u0"))
    assert steps == (Loop((("a", "u0"),), (Read("a", ("y0",)),), ("a.y0", "a.u0", "a.y0")),)


def test_a_circle_through_a_state_is_no_loop():
    steps, _ = planned({"a": block(1, 1), "b": block(1, 1, {"y0": ()})}, ("a.y0", "b.u0"), ("b.y0", "a.u0"))
    assert steps == (Read("b", ("y0",)), Read("a", ("y0",)))


def test_a_component_that_answers_in_a_step_only_is_reported_as_a_delay():
    parts = {"a": block(1, 1), "bus": block(2, 2, {"y0": ("u0",), "y1": ()})}
    _, wiring = planned(parts, ("a.y0", "bus.u0"), ("bus.y0", "a.u0"))
    delay = forced_delay(wiring, "bus", parts["bus"].feedthrough)
    assert str(delay) == "bus: y0 follows u0 one step late"
    steps = plan(wiring, {"a": {}, "bus": without_feedthrough(wiring, "bus")})
    assert steps == (Read("bus", ("y0",)), Read("a", ("y0",)))
    assert forced_delay(wiring, "bus", {"y0": (), "y1": ("u0",)}) is None


def test_inputs_of_the_system_wait_for_nothing_and_its_outputs_are_read():
    system, parts = pair()
    system = System("s", system.components, inputs={"x": ("spring.x1", "spring.x2")}, outputs={"F": "spring.F1"})
    assert plan(wire(system, parts), {name: p.feedthrough for name, p in parts.items()}) == (Read("spring", ("F1",)),)


@st.composite
def systems(draw):
    """Systems of small blocks with any dependencies and any connections."""
    parts, ends = {}, []
    for k in range(draw(st.integers(1, 5))):
        inputs, outputs = draw(st.integers(0, 3)), draw(st.integers(1, 3))
        names = [f"u{i}" for i in range(inputs)]
        through = {f"y{j}": tuple(draw(st.sets(st.sampled_from(names)))) if names else () for j in range(outputs)}
        for name in draw(st.sets(st.sampled_from(sorted(through)))):
            del through[name]
        parts[f"c{k}"] = block(inputs, outputs, through)
    sources = [f"{name}.{p.name}" for name, part in parts.items() for p in part.ports if p.causality == "output"]
    for name, part in parts.items():
        for port in part.ports:
            if port.causality == "input" and draw(st.booleans()):
                ends.append((draw(st.sampled_from(sources)), f"{name}.{port.name}"))
    return parts, ends


def reachable(edges: set[tuple[str, str]]) -> set[tuple[str, str]]:
    closure = set(edges)
    for middle in {node for edge in edges for node in edge}:
        closure |= {(a, d) for a, b in closure if b == middle for c, d in closure if c == middle}
    return closure


@given(systems())
def test_what_is_read_depends_on_nothing_that_is_set_later_and_loops_are_those_that_reach_themselves(drawn):
    parts, ends = drawn
    steps, _ = planned(parts, *ends)
    source_of = {target: start for start, target in ends}
    needs = {}
    for name, part in parts.items():
        driven = [p.name for p in part.ports if f"{name}.{p.name}" in source_of]
        for port in part.ports:
            if port.causality == "output":
                through = [u for u in part.feedthrough.get(port.name, driven) if u in driven]
                needs[f"{name}.{port.name}"] = {f"{name}.{u}" for u in through}
    edges = {(source_of[u], u) for u in source_of} | {(u, y) for y, before in needs.items() for u in before}
    closure = reachable(edges)
    looped = {node for node in needs if (node, node) in closure and node in {start for start, _ in ends}}
    known = set()

    def read(step, guessed=frozenset()):
        for output in (f"{step.component}.{name}" for name in step.outputs):
            assert all(u in guessed or source_of[u] in known for u in needs[output])
            known.add(output)

    in_loops = set()
    for step in steps:
        if isinstance(step, Read):
            read(step)
            continue
        guessed = {".".join(tear) for tear in step.tears}
        for inner in step.reads:
            read(inner, guessed)
            in_loops |= {f"{inner.component}.{name}" for name in inner.outputs}
        assert {source_of[tear] for tear in guessed} <= in_loops
        around = list(zip(step.path, step.path[1:], strict=False))
        assert set(around) <= edges
    assert known == set(source_of.values())
    assert in_loops == looped
