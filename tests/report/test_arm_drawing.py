"""The drawn arm obeys the arm's geometry, and its arrows follow what they stand for in sign and size."""

import cmath
import math
import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.catalogue import find_modelica_model
from orchestrator.report.arm_drawing import (
    NOMINAL_ARM,
    ArmShape,
    Instant,
    Line,
    Panel,
    Replay,
    Scales,
    arm_svg,
    replay_html,
)
from orchestrator.report.arm_drawing.arrows import LARGEST_TURN, RADIUS, force_path, torque_path
from orchestrator.report.arm_drawing.shape import Corner, joints, muscle_path
from orchestrator.report.numbers import ticks
from orchestrator.report.thinning import extremes

ANGLES = st.tuples(st.floats(-0.5, 1.8), st.floats(-0.2, 2.5))
MUSCLES = range(6)


@given(ANGLES)
def test_links_keep_their_lengths_and_meet_where_complex_numbers_put_them(q: tuple[float, float]) -> None:
    shoulder, elbow, wrist = (complex(*point) for point in joints(NOMINAL_ARM, q))

    assert abs(elbow - shoulder) == pytest.approx(0.33, abs=1e-12)
    assert abs(wrist - elbow) == pytest.approx(0.32, abs=1e-12)
    assert abs(wrist - cmath.exp(1j * q[0]) * (0.33 + 0.32 * cmath.exp(1j * q[1]))) < 1e-12


@given(ANGLES, st.sampled_from(MUSCLES))
def test_tension_in_a_drawn_string_turns_each_joint_by_its_moment_arm(q: tuple[float, float], muscle: int) -> None:
    path = muscle_path(NOMINAL_ARM, q, muscle)
    arms = [NOMINAL_ARM.shoulder_arms[muscle], NOMINAL_ARM.elbow_arms[muscle]]
    passed = [(joint, arm) for joint, arm in enumerate(arms) if arm]
    corners = [k for k, part in enumerate(path) if isinstance(part, Corner)]

    assert len(corners) == len(passed)
    for place, (joint, arm) in zip(corners, passed, strict=True):
        here, after = path[place], path[place + 1]
        assert isinstance(here, Corner)
        beyond = complex(*(after.enter if isinstance(after, Corner) else after))
        lever = complex(*here.leave) - complex(*joints(NOMINAL_ARM, q)[joint])
        pull = complex(*here.leave) - beyond
        torque = (lever.conjugate() * pull / abs(pull)).imag
        assert torque == pytest.approx(arm, abs=1e-9)


def test_nominal_shape_is_that_of_the_library() -> None:
    library = {p.name: p.start for p in find_modelica_model("arm").compile().parameters}

    assert ArmShape.of(library) == NOMINAL_ARM


def test_a_model_that_is_no_arm_has_no_shape() -> None:
    assert ArmShape.of({"linkage.l[1]": 0.3, "m": 1.0}) is None


def sweep_of(path: str) -> float:
    """Angle in rad that an arrow round the origin turns through, against the clock positive, from its SVG arc."""
    found = re.match(r"M(\S+) (\S+) A\S+ \S+ 0 (\d) (\d) (\S+) (\S+)", path)
    assert found
    x1, y1, large, clockwise, x2, y2 = map(float, found.groups())
    # SVG's y points downwards.
    turn = cmath.phase(complex(x2, -y2) / complex(x1, -y1))
    if (abs(turn) > math.pi) != bool(large) or (turn > 0) == bool(clockwise):
        turn -= math.copysign(math.tau, turn)
    assert (abs(turn) > math.pi - 1e-2) >= bool(large)
    return turn


@given(st.floats(0.05, 4.1), st.sampled_from([-1.0, 1.0]), st.floats(0.1, 3.0), st.floats(-3, 3))
def test_round_arrow_turns_as_the_torque_does_and_as_far_as_it_is_large(
    angle: float, sign: float, turn: float, direction: float
) -> None:
    path = torque_path((0.0, 0.0), direction, sign * angle / turn, turn)

    # Coordinates are rounded to 0.1 mm on a circle of 75 mm.
    assert sweep_of(path) == pytest.approx(sign * angle, abs=3e-3)


def test_round_arrow_grows_no_further_than_its_limit_and_vanishes_at_zero() -> None:
    assert sweep_of(torque_path((0.0, 0.0), 0.0, 1e6, 1.0)) == pytest.approx(LARGEST_TURN, abs=3e-3)
    assert torque_path((0.0, 0.0), 0.0, 0.0, 1.0) == ""


@given(st.floats(0.02, 0.19), st.floats(-math.pi, math.pi), ANGLES)
def test_straight_arrow_points_along_the_force_and_is_as_long_as_it_is_large(
    reach: float, heading: float, q: tuple[float, float]
) -> None:
    scale, wrist = 0.01, joints(NOMINAL_ARM, q)[2]
    force = cmath.rect(reach / scale, heading)
    path = force_path(wrist, (force.real, force.imag), scale)
    x1, y1, x2, y2 = map(float, re.match(r"M(\S+) (\S+) L(\S+) (\S+)", path).groups())  # type: ignore[union-attr]

    drawn = complex(x2 - x1, -(y2 - y1)) / 1000
    assert complex(x1, -y1) / 1000 == pytest.approx(complex(*wrist), abs=1e-4)
    assert drawn == pytest.approx(cmath.rect(reach, heading), abs=2e-4)


def test_scales_give_the_largest_arrows_their_full_size_and_see_every_joint() -> None:
    instants = [Instant((0.2, 0.3), torque=(0.5, -2.0)), Instant((1.5, 2.0), torque=(0.1, 0.1), modelled=(-0.4, 0.0))]
    scales = Scales.of(NOMINAL_ARM, instants)

    assert 2.0 * scales.turn == pytest.approx(LARGEST_TURN)
    assert "a quarter turn is 748 mN.m" in scales.words()  # 2 N.m (pi / 2) / 4.2
    left, bottom, right, top = scales.box
    for q in ((0.2, 0.3), (1.5, 2.0), (-0.4, 0.0)):
        for x, y in joints(NOMINAL_ARM, q):
            assert left + RADIUS < x < right - RADIUS
            assert bottom + RADIUS < y < top - RADIUS


@pytest.mark.parametrize(
    "instant",
    [
        Instant((0.8, 1.2)),
        Instant((0.8, 1.2), (0.4, -0.2), (0.05, 0.01), (3.0, -1.0), (0, 0.1, 1, 0, 0, 0.5), (0.9, 1.1), 2.5),
    ],
    ids=["bare", "full"],
)
def test_picture_is_well_formed_and_says_its_numbers(instant: Instant) -> None:
    svg = ElementTree.fromstring(arm_svg(instant))
    label = svg.attrib["aria-label"]

    assert "shoulder 800 mrad, elbow 1.20 rad" in label
    assert ("residual torque shoulder 400 mN.m ± 82.2 mN.m (90 %)" in label) == (instant.torque is not None)
    assert ("3.16 N" in label) == (instant.force is not None)
    assert len(svg.findall(".//{*}path[@class='muscle']")) == 6


def replay(count: int = 5000) -> Replay:
    """A swing of 10 s with a residual torque that is largest at 3 s."""
    time = np.linspace(0.0, 10.0, count)
    q = np.column_stack([0.8 + 0.3 * np.sin(time), 1.2 + 0.4 * np.cos(time)])
    torque = np.column_stack([np.exp(-((time - 3) ** 2)), 0.2 * np.sin(time)])
    panel = Panel("shoulder angle", "rad", (Line("<measured>", "#000000", q[:, 0]),))
    return Replay(time, q, torque, 0.05 * np.ones((count, 2)), modelled=q + 0.1, panels=(panel,))


def test_replay_starts_where_the_torque_is_largest_and_stays_small() -> None:
    found = replay()
    page = replay_html(found, "Trial <1> & more")

    assert found.time[found.worst] == pytest.approx(3.0, abs=0.005)
    assert "The arm at 3.00 s" in page
    assert len(page) < 100_000
    assert "<1>" not in page and "<measured>" not in page


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=3000), st.integers(4, 400))
def test_a_thinned_curve_keeps_its_ends_and_its_extremes(values: list[float], most: int) -> None:
    series = np.array(values)
    kept = extremes(series, most)

    assert np.all(np.diff(kept) > 0)
    assert series[kept].min() == series.min() and series[kept].max() == series.max()
    assert kept[0] == 0 and kept[-1] == len(series) - 1
    assert len(kept) <= max(most + 2, 4)


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6), st.integers(3, 9))
def test_ticks_are_few_and_within_the_axis(low: float, span: float, most: int) -> None:
    high = low + span
    if high - low <= 1e-9 * max(abs(low), abs(high)):
        return
    found = ticks(low, high, most)

    assert 1 <= len(found) <= most
    slack = 1e-5 * max(abs(low), abs(high))
    assert all(low - slack <= value <= high + slack for value in found)
