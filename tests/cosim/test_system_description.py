"""The frozen description of a system."""

import numpy as np
import pytest

from fmus.errors import ComponentError, MisfitError
from orchestrator.cosim import Component, ComponentSpec, Port, StepEnd, System, Value
from orchestrator.cosim.system import split_address


class Constant(Component):
    """The least that a component can be."""

    kind = "constant"
    ports = (Port("y", "output"),)
    feedthrough = {"y": ()}

    def initialise(self, time, stop, tolerance):
        pass

    def start(self):
        pass

    def set(self, names, values):
        pass

    def get(self, names):
        return [1.0 for _ in names]

    def step(self, time, size):
        return StepEnd(time + size)

    def terminate(self):
        pass


def test_elements_count_as_many_as_the_array_holds():
    port = Port("a.b", "output", shape=(2, 3))
    assert port.size == 6 == len(port.elements) == np.zeros(port.shape).size
    assert port.elements[-1] == "a.b[6]"
    assert Port("x", "input").elements == ["x"]


def test_values_given_later_go_before_those_of_the_file():
    arm = ComponentSpec("arm", values={"m": Value(1.0, "kg"), "d": Value(0.1)})
    system = System("s", {"arm": arm}).with_values({"arm.m": Value(2.0, "kg"), "arm.joint.k": Value(3.0)})
    assert system.components["arm"].values == {"m": Value(2.0, "kg"), "d": Value(0.1), "joint.k": Value(3.0)}


def test_an_unknown_component_is_named_with_the_known_ones():
    system = System("pair", {"mass": ComponentSpec("mass"), "spring": ComponentSpec("spring")})
    with pytest.raises(MisfitError, match="'pair' has no component 'sprng'; it has mass, spring"):
        system.with_component(ComponentSpec("sprng"))


@pytest.mark.parametrize("address", ["x", ".x", "x.", ""])
def test_an_address_needs_a_component_and_a_variable(address):
    with pytest.raises(MisfitError, match="expected COMPONENT.VARIABLE"):
        split_address(address)


def test_a_component_says_what_it_cannot_do():
    with pytest.raises(ComponentError, match="a constant component cannot save its state"):
        Constant().save()
    with pytest.raises(ComponentError, match="offers no derivatives"):
        Constant().derivative(["y"], [], [])
