"""Effects at the joints of a machine, under the ids of the contract; sizes count in the machine's small torque."""

import numpy as np

from tests.benchmarks.diagnosis.truth.context import Context, Sized, indexed, joint_site, numbered
from tests.benchmarks.diagnosis.truth.run import Injection

LOOP_SHAPE = 0.7


def viscous_friction(context: Context) -> Sized:
    """Torque -b w."""
    shares = context.shares()
    damping = shares * context.machine.torque / max(context.speed(0), 0.1)
    return lambda s: Injection(
        "viscous_friction", joint_site(shares), indexed("b", s * damping), numbered("b", s * damping)
    )


def coulomb_friction(context: Context) -> Sized:
    """Dry friction that holds a joint at rest exactly."""
    shares = context.shares()
    size = shares * context.machine.torque
    return lambda s: Injection(
        "coulomb_friction", joint_site(shares), indexed("tauC", s * size), numbered("c", s * size)
    )


def stribeck_friction(context: Context) -> Sized:
    """Dry friction with a breakaway part that fades with speed."""
    shares, extra = context.shares(), context.random.uniform(0.8, 2.0)
    size, vs = shares * context.machine.torque, context.random.uniform(0.1, 0.3) * max(context.speed(0), 0.3)
    return lambda s: Injection(
        "stribeck_friction",
        joint_site(shares),
        {**indexed("tauC", s * size), **indexed("tauExtra", s * size * extra), "vS": vs},
        {**numbered("c", s * size), **numbered("s", s * size * extra), "vs": vs},
    )


def joint_drag(context: Context) -> Sized:
    """Torque -c |w| w."""
    shares = context.shares()
    size = shares * context.machine.torque / max(context.speed(0), 0.1) ** 2
    return lambda s: Injection("quadratic_drag", joint_site(shares), indexed("c", s * size), numbered("d", s * size))


def passive_stiffness(context: Context) -> Sized:
    """Torque -k (q - rest)."""
    shares = context.shares()
    stiffness = shares * context.machine.torque / 0.5
    rest = np.array([context.quantile(j, context.random.uniform(0.2, 0.8)) for j in range(len(shares))])
    return lambda s: Injection(
        "passive_stiffness",
        joint_site(shares),
        {**indexed("k", s * stiffness), **indexed("tau0", s * stiffness * rest)},
        {**numbered("k", s * stiffness), **numbered("t", s * stiffness * rest)},
    )


def hysteresis(context: Context) -> Sized:
    """Bouc-Wen loop with exponent 1 and the shape that the library's law has: a card fits size and width only."""
    shares = context.shares()
    size = shares * context.machine.torque
    width = context.random.uniform(0.1, 0.25) * (context.quantile(0, 0.9) - context.quantile(0, 0.1))
    width = float(np.clip(width, 0.02, 0.8))
    return lambda s: Injection(
        "hysteresis",
        joint_site(shares),
        {**indexed("H", s * size), "xYield": width},
        {**numbered("h", s * size), "hx": width, "hsigma": LOOP_SHAPE},
    )


def cogging(context: Context) -> Sized:
    """Torque that repeats with the position of the joint."""
    shares, waves, phase = context.shares(), context.random.uniform(6, 25), context.random.uniform(0, 2 * np.pi)
    size = shares * context.machine.torque
    return lambda s: Injection(
        "cogging",
        joint_site(shares),
        {
            **indexed("sine", s * size * np.cos(phase)),
            **indexed("cosine", s * size * np.sin(phase)),
            "periods": waves,
        },
        {**numbered("g", s * size), "gn": waves, "gphase": phase},
    )


def rotor_inertia(context: Context) -> Sized:
    """Inertia about the joint axis."""
    shares = context.shares()
    size = shares * context.machine.torque / max(4 * context.speed(0), 0.1)
    return lambda s: Injection("rotor_inertia", joint_site(shares), indexed("J", s * size), numbered("j", s * size))


def end_stop(context: Context) -> Sized:
    """One-sided spring at one joint, inside the range in which it moves."""
    joint, side = int(context.random.integers(context.machine.joints)), int(context.random.choice([-1, 1]))
    at = context.quantile(joint, 0.8 if side > 0 else 0.2)
    stiffness = context.machine.torque / 0.1
    k = joint + 1
    return lambda s: Injection(
        "end_stop",
        f"joint{k}",
        {f"k[{k}]": s * stiffness, f"qStop[{k}]": at},
        {f"stop{k}": s * stiffness, "stopat": at, "side": side},
    )


def tremor(context: Context) -> Sized:
    """Periodic torque, its phase another in each trial."""
    shares, hz = context.shares(), context.random.uniform(3.0, 6.0)
    size = shares * context.machine.torque
    return lambda s: Injection(
        "tremor",
        joint_site(shares),
        {**indexed("amplitude", s * size), "frequency": hz},
        {**numbered("tr", s * size), "trf": hz, "trp": 1.0},
    )


def constant_torque(context: Context) -> Sized:
    """Steady torque."""
    shares, sign = context.shares(), context.random.choice([-1.0, 1.0])
    size = sign * shares * context.machine.torque
    return lambda s: Injection("constant_force", joint_site(shares), indexed("tau0", s * size), numbered("t", s * size))


def backlash(context: Context) -> Sized:
    """Play between motor and load."""
    return lambda s: Injection("backlash", "joint1", {"gap": 0.002 * s}, {"gap": 0.002 * s})


def joint_elasticity(context: Context) -> Sized:
    """The drive is two masses on a flexible shaft; its encoder sits on the motor."""
    share, whole = context.random.uniform(0.3, 0.7), context.machine.values["J"]
    values = {"JMotor": share * whole, "JLoad": (1 - share) * whole, "d": 0.02}
    named = {"d": 0.02, "share": share}
    return lambda s: Injection("joint_elasticity", "joint1", {**named, "k": 400.0 / s}, {**values, "k": 400.0 / s})
