"""Descriptions of components for tests: ports and what depends on what, nothing that runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from orchestrator.cosim import ComponentSpec, Connection, Port, System


@dataclass(frozen=True)
class Described:
    """What is known of a component before it is loaded."""

    ports: Sequence[Port]
    feedthrough: Mapping[str, Sequence[str]] = field(default_factory=dict)
    follows_inputs: bool = True


def source(**keywords) -> Described:
    """A component with one output y."""
    return Described([Port("y", "output", **keywords)], {"y": ()})


def sink(**keywords) -> Described:
    """A component with one input u."""
    return Described([Port("u", "input", **keywords)])


def two(one: Described, other: Described, **keywords) -> tuple[System, dict[str, Described]]:
    """A system a.y -> b.u of two components."""
    components = {"a": ComponentSpec("a"), "b": ComponentSpec("b")}
    return System("two", components, (Connection("a.y", "b.u", **keywords),)), {"a": one, "b": other}


MASS = Described(
    [
        Port("Fa", "input", unit="N", start=0.0),
        Port("Fb", "input", unit="N", start=0.0),
        Port("x", "output", unit="m"),
        Port("v", "output", unit="m/s"),
        Port("m", "parameter", unit="kg", start=1.0, variability="fixed", minimum=0.0),
    ],
    {"x": (), "v": ()},
)
SPRING = Described(
    [
        Port("x1", "input", unit="m", start=0.0),
        Port("v1", "input", unit="m/s", start=0.0),
        Port("x2", "input", unit="m", start=0.0),
        Port("v2", "input", unit="m/s", start=0.0),
        Port("F1", "output", unit="N"),
        Port("F2", "output", unit="N"),
        Port("k", "parameter", unit="N/m", start=10.0, variability="fixed"),
    ],
    {"F1": ("x1", "v1", "x2", "v2"), "F2": ("x1", "v1", "x2", "v2")},
)


def pair() -> tuple[System, dict[str, Described]]:
    """The mass on a spring of the benchmark."""
    connections = [("mass.x", "spring.x2"), ("mass.v", "spring.v2"), ("spring.F2", "mass.Fa")]
    components = {"mass": ComponentSpec("mass"), "spring": ComponentSpec("spring")}
    system = System("pair", components, tuple(Connection(*ends) for ends in connections))
    return system, {"mass": MASS, "spring": SPRING}
