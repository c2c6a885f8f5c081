"""Whatever a broken FMU records, every check answers with a verdict and one line."""

import json
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from orchestrator.regress.comparison import (
    Bounds,
    Conserved,
    EndValue,
    Events,
    Funnel,
    Pointwise,
    Signal,
    Statistics,
    SteadyState,
    Tolerance,
    Tube,
)

odd = st.sampled_from([0.0, 1.0, -1.0, 0.5, 1e-300, 1e300, -1e300, math.nan, math.inf, -math.inf])
usual = st.floats(-10.0, 10.0)
columns = st.lists(st.one_of(usual, usual, odd), max_size=12)


@st.composite
def signals(draw: st.DrawFn) -> Signal:
    values = draw(columns)
    time = draw(columns)
    if draw(st.booleans()):
        time = sorted(draw(st.lists(st.integers(0, 8), min_size=len(values), max_size=len(values))))
    nominal = draw(st.sampled_from([None, 0.0, 1.0, 1e5]))
    return Signal("x", np.array(time), np.array(values), "m", draw(st.sampled_from(["linear", "hold"])), nominal)


@st.composite
def tolerances(draw: st.DrawFn) -> Tolerance:
    moment = st.none() | st.floats(-1.0, 9.0) | odd
    figure = st.sampled_from([0.0, 0.1, 1.0, 100.0])
    return Tolerance(
        draw(st.none() | figure | odd), draw(figure), draw(figure), draw(figure), draw(moment), draw(moment)
    )


@st.composite
def checks(draw: st.DrawFn):
    tolerance = draw(tolerances())
    return draw(
        st.sampled_from(
            [
                Tube(tolerance),
                Funnel(tolerance, 0.5),
                Pointwise(tolerance),
                EndValue(tolerance),
                EndValue(tolerance, 2.0),
                Bounds(-1.0, 1.0, tolerance),
                Conserved("never_rises", tolerance),
                SteadyState(1.0, tolerance=tolerance),
                SteadyState(1.0, 1.0, tolerance),
                Statistics(1.5, ("mean", "spread", "lowest", "highest"), tolerance),
                Events(level=0.5, tolerance=tolerance),
                Events(tolerance=tolerance, direction="rising"),
                Events(times=(1.0, 2.0), tolerance=tolerance),
            ]
        )
    )


@settings(max_examples=600, deadline=None)
@given(checks(), signals(), signals() | st.none(), st.booleans())
def test_every_check_answers_whatever_it_is_given(check, signal, reference, same: bool) -> None:
    verdict = check.judge(signal, signal if same else reference)

    assert verdict.reason and "\n" not in verdict.reason
    json.dumps(verdict.to_json(), allow_nan=False)
    if not np.isfinite(signal.values).all() or not np.isfinite(signal.time).all() or not len(signal.time):
        assert not verdict.passed
