"""What a number in a bench file may be: beyond it, a limit would limit nothing, or a number in the wrong unit is meant.

These are no recommendations. They are far wider than what any arm beside a person needs, and narrower than what a time in
milliseconds, or a limit that was switched off by a large number, comes to.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from fmus.errors import MisfitError
from hil.safety.limits import JointLimits

# Lowest and highest number, and unit. The time limits leave a few cycles at 10 Hz.
LIMITS: Mapping[str, tuple[float, float, str]] = {
    "power": (0.0, 1e3, "W"),
    "energy": (0.0, 1e3, "J"),
    "leak": (0.0, 10.0, "W"),
    "damping": (0.0, 20.0, "N.m.s/rad"),
    "ramp_s": (0.0, 30.0, "s"),
    "bandwidth": (20.0, 1e4, "rad/s"),
    "reduced": (0.0, 1.0, "of the torque"),
    "missing_comply_s": (0.0, 0.5, "s"),
    "missing_release_s": (0.0, 1.0, "s"),
    "answer_s": (0.0, 0.1, "s"),
    "late_comply_s": (0.0, 1.0, "s"),
    "stall_s": (0.0, 0.2, "s"),
    "force_missing_s": (0.0, 0.5, "s"),
    "frozen_s": (0.0, 2.0, "s"),
    "effect_s": (0.0, 2.0, "s"),
    "unexplained": (0.0, 20.0, "rad/s"),
    "reach": (0.0, 3.0, "m"),
    "oscillation": (1, 100, "changes of sign a second"),
    "disagreement": (0.0, 50.0, "N.m"),
    "force": (0.0, 500.0, "N"),
    "warm": (0.0, 120.0, "degC"),
    "hot": (0.0, 120.0, "degC"),
    "thermal_s": (1.0, 3600.0, "s"),
    "pinch_s": (0.0, 2.0, "s"),
}
JOINTS: Mapping[str, tuple[float, float, str]] = {
    "torque": (0.0, 1e3, "N.m"),
    "torque_rate": (0.0, 1e5, "N.m/s"),
    "speed": (0.0, 20.0, "rad/s"),
    # Three turns; more is an angle in degrees.
    "low": (-20.0, 20.0, "rad"),
    "high": (-20.0, 20.0, "rad"),
    "margin": (0.0, 0.5, "rad"),
    "breakaway": (0.0, 1e3, "N.m"),
    "continuous": (0.0, math.inf, "N.m"),
}
GAINS: Mapping[str, tuple[float, float, str]] = {
    "stiffness": (0.0, 5e3, "N.m/rad"),
    "damping": (0.0, 200.0, "N.m.s/rad"),
    "proof_torque": (0.0, 1e3, "N.m"),
}
PLACES: Mapping[str, tuple[float, float, str]] = {"shoulder": (-math.pi, math.pi, "rad")}
WHOLE = ("oscillation",)


def check_numbers(table: Mapping[str, Any], known: Mapping[str, tuple[float, float, str]]) -> None:
    """Refuse a value that is no number, or that is outside what its key may be; lists are looked at number by number.

    What is below its lowest number, or not finite, but of the right kind is left to the limits themselves.

    Raises:
        MisfitError: with key, value and what was expected.
    """
    for key, given in table.items():
        if key not in known:
            continue
        low, high, unit = known[key]
        for value in given if isinstance(given, list) else [given]:
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise MisfitError(f"{key} = {value!r}; a number in {unit} was expected")
            if key in WHOLE and not isinstance(value, int):
                raise MisfitError(f"{key} = {value:g}; a whole number was expected")
            if math.isfinite(value) and (value > high or (low != 0.0 and value < low)):
                hint = "; times are in seconds" if unit == "s" and value > high else ""
                hint = "; is it in degrees?" if unit == "rad" else hint
                raise MisfitError(f"{key} = {value:g} {unit} is outside [{low:g}, {high:g}] {unit}{hint}")


def check_effect_is_seen(number: int, joint: JointLimits) -> None:
    """Refuse a joint whose torque may never be so large that it must move it: lost torques would go unnoticed.

    Raises:
        MisfitError: with both torques.
    """
    if not joint.breakaway < joint.torque:
        raise MisfitError(
            f"breakaway = {joint.breakaway:g} N.m is not below torque = {joint.torque:g} N.m: nobody would notice that torques do"
            f" not reach joint {number}, or that its encoder is frozen; name the torque that moves it for certain"
        )


def check_proof(torques: Sequence[float], joints: Sequence[JointLimits]) -> None:
    """Refuse a proof that asks for more than a joint may get: its torque would not grow slowly, but be cut at the limit.

    Raises:
        MisfitError: with the joint and both torques.
    """
    for number, (torque, joint) in enumerate(zip(torques, joints, strict=False), start=1):
        if torque > joint.torque:
            raise MisfitError(
                f"proof_torque = {torque:g} N.m of joint {number} is above its torque, {joint.torque:g} N.m"
            )


def table_of(document: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """A table of a bench file; empty if it is not there.

    Raises:
        MisfitError: if it is something else.
    """
    found = document.get(key, {})
    if not isinstance(found, Mapping):
        raise MisfitError(f"{key} = {found!r}; a table [{key}] was expected")
    return found
