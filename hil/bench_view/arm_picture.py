"""The emulated arm of a session as it stands now, drawn as the report draws it."""

from hil.bench_view.watched import Watched
from orchestrator.report.arm_drawing import ArmShape, Instant, Scales, arm_svg

# Fixed, so that pictures of different moments can be compared: a quarter turn is 1 N.m, 10 cm are 20 N; metres in view.
SCALES = Scales(turn=1.5708, length=0.005, box=(-0.35, -0.22, 0.7, 0.7))


def arm_picture(seen: Watched) -> str:
    """The arm with its residual torque, the force on its wrist and its muscles; nothing if no arm is emulated."""
    arm, q = seen.about.get("arm"), seen.pair("arm_q")
    if arm is None or q is None:
        return ""
    shoulder, elbow = (tuple(map(float, row)) for row in arm["moment_arms"])
    shape = ArmShape((float(arm["length"][0]), float(arm["length"][1])), shoulder, elbow)
    torque, force = seen.pair("residual"), seen.pair("pull")
    deviation = seen.pair("residual_sd")
    alpha = tuple(seen.signal(f"alpha_{k}") or 0.0 for k in range(1, 7))
    instant = Instant(
        (float(q[0]), float(q[1])),
        torque=None if torque is None else (float(torque[0]), float(torque[1])),
        torque_std=None if deviation is None else (float(deviation[0]), float(deviation[1])),
        force=None if force is None else (float(force[0]), float(force[1])),
        activation=alpha,
    )
    return arm_svg(instant, shape, SCALES)
