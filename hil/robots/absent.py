"""Safeguards that a robot may lack: a session refuses to arm it, unless its bench file says in so many words that it may."""

from collections.abc import Collection

from hil.robots.base import Robot
from hil.safety.limits import Limits

MODULE, SENSOR = "safety module", "force sensor"
# What a bench file calls them.
KEYS = {"without_safety_module": MODULE, "without_force_sensor": SENSOR}
_LACKS = {
    MODULE: "nothing but this computer would stop the arm",
    SENSOR: "nobody would notice how hard the arm pushes whoever holds it",
}


def absent(robot: Robot) -> list[str]:
    """The safeguards that a robot lacks."""
    return list(robot.lacks)


def refusals(robot: Robot, waived: Collection[str]) -> list[str]:
    """Why a robot may not be armed for what it lacks, in words; empty if it may."""
    return [refusal(name) for name in absent(robot) if name not in waived]


def refusal(name: str) -> str:
    """Why a robot without this safeguard is not armed."""
    key = next(key for key, safeguard in KEYS.items() if safeguard == name)
    return (
        f"no {name} answers: {_LACKS[name]}. Look at its cable and power; to run without one all the same, with lower limits,"
        f" say {key} = true in [robot] of the bench file"
    )


def warning(waived: Collection[str]) -> str:
    """What a screen says all the time in a session that may do without safeguards; "" if it may not."""
    return f"WITHOUT {' AND WITHOUT '.join(sorted(waived)).upper()}: limits are halved" if waived else ""


def unchecked(limits: Limits) -> str:
    """What a screen says of joints of which nobody knows what torque moves them; "" if that is known of all."""
    joints = [str(k) for k, joint in enumerate(limits.joints, start=1) if not joint.breakaway < joint.torque]
    if not joints:
        return ""
    return (
        f"NOT NOTICED at joint {', '.join(joints)}: torques that do not arrive, and an encoder that freezes at rest; say in"
        " [[joints]] of the bench file which torque moves it for certain (breakaway)"
    )
