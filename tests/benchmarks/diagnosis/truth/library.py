"""Which effects can be put into which machine."""

from collections.abc import Callable

from tests.benchmarks.diagnosis.truth import (
    arm_effects,
    foreign_effects,
    joint_effects,
    rail_effects,
    signal_effects,
    tank_effects,
)
from tests.benchmarks.diagnosis.truth.context import Context, Sized
from tests.benchmarks.diagnosis.truth.machines import Machine

Draw = Callable[[Context], Sized]

_JOINT: dict[str, Draw] = {
    "viscous_friction": joint_effects.viscous_friction,
    "coulomb_friction": joint_effects.coulomb_friction,
    "stribeck_friction": joint_effects.stribeck_friction,
    "quadratic_drag": joint_effects.joint_drag,
    "passive_stiffness": joint_effects.passive_stiffness,
    "hysteresis": joint_effects.hysteresis,
    "cogging": joint_effects.cogging,
    "rotor_inertia": joint_effects.rotor_inertia,
    "end_stop": joint_effects.end_stop,
    "tremor": joint_effects.tremor,
    "constant_force": joint_effects.constant_torque,
}
# The cart's friction may sit at the pole's hinge or under its wheels.
_RAIL: dict[str, Draw] = {
    name: rail_effects.hinge_or_rail(_JOINT[name], on_rail)
    for name, on_rail in (
        ("viscous_friction", rail_effects.viscous_friction),
        ("coulomb_friction", rail_effects.coulomb_friction),
        ("stribeck_friction", rail_effects.stribeck_friction),
        ("quadratic_drag", rail_effects.drag),
    )
}
_SENSOR: dict[str, Draw] = {
    "joint_offset": signal_effects.joint_offset,
    "joint_scale": signal_effects.joint_scale,
    "sensor_lag": signal_effects.sensor_lag,
}
_COMMAND: dict[str, Draw] = {
    "stimulation_delay": signal_effects.stimulation_delay,
    "saturation": signal_effects.saturation,
}
_ARM: dict[str, Draw] = {
    "quadratic_drag": arm_effects.wrist_drag,
    "constant_force": arm_effects.wrist_force,
    "payload": arm_effects.payload,
    "gravity_tilt": arm_effects.gravity_tilt,
    "activation_dynamics": arm_effects.activation_dynamics,
    "recruitment_curve": arm_effects.recruitment_curve,
    "fatigue": arm_effects.fatigue,
    "muscle_weakness": arm_effects.muscle_weakness,
    "moment_arm_error": arm_effects.moment_arm_error,
    "stimulation_crosstalk": arm_effects.stimulation_crosstalk,
    "stretch_reflex": arm_effects.stretch_reflex,
    "series_elasticity": arm_effects.series_elasticity,
    "force_sensor_gain": arm_effects.force_sensor_gain,
    "force_sensor_offset": arm_effects.force_sensor_offset,
}

EFFECTS: dict[str, dict[str, Draw]] = {
    "arm": {**_JOINT, **_COMMAND, **_SENSOR, **_ARM},
    "pendulum": {**_JOINT, **_SENSOR},
    "drive": {**_JOINT, **_COMMAND, **_SENSOR, "joint_elasticity": joint_effects.joint_elasticity},
    "two-mass": {**_JOINT, **_COMMAND, **_SENSOR, "backlash": joint_effects.backlash},
    "cart": {**_JOINT, **_RAIL, **_COMMAND, **_SENSOR},
    "double-pendulum": {**_JOINT, **_SENSOR},
    "tanks": {**_COMMAND, **_SENSOR, "leak": tank_effects.leak, "outlet_error": tank_effects.outlet_error},
}
# A turn of the encoder's zero changes nothing on a drive that has no preferred angle.
del EFFECTS["drive"]["joint_offset"]

_FOREIGN_ONE: dict[str, Draw] = {
    "position_dependent_friction": foreign_effects.position_dependent_friction,
    "cubic_spring": foreign_effects.cubic_spring,
    "warming_friction": foreign_effects.warming_friction,
}
_FOREIGN_TWO = {**_FOREIGN_ONE, "coupling_friction": foreign_effects.coupling_friction}
FOREIGN: dict[str, dict[str, Draw]] = {
    "arm": {**_FOREIGN_TWO, "external_push": foreign_effects.external_push},
    "pendulum": _FOREIGN_ONE,
    "drive": _FOREIGN_ONE,
    "two-mass": _FOREIGN_TWO,
    "cart": {**_FOREIGN_ONE, "uneven_rail": foreign_effects.uneven_rail},
    "double-pendulum": {**_FOREIGN_TWO, "external_push": foreign_effects.external_push},
    "tanks": {"clogging_outlet": foreign_effects.clogging_outlet, "overflow": foreign_effects.overflow},
}

# Pairs that are easily taken for each other or hide each other.
CONFUSABLE = (
    ("viscous_friction", "coulomb_friction"),
    ("viscous_friction", "quadratic_drag"),
    ("coulomb_friction", "hysteresis"),
    ("stimulation_delay", "activation_dynamics"),
    ("payload", "force_sensor_gain"),
    ("payload", "rotor_inertia"),
    ("muscle_weakness", "fatigue"),
    ("muscle_weakness", "moment_arm_error"),
    ("constant_force", "gravity_tilt"),
    ("passive_stiffness", "end_stop"),
    ("joint_offset", "joint_scale"),
    ("sensor_lag", "stimulation_delay"),
    ("leak", "outlet_error"),
)


def confusable_pairs(machine: Machine) -> list[tuple[str, str]]:
    """Confusable pairs that a machine can have."""
    return [pair for pair in CONFUSABLE if set(pair) <= EFFECTS[machine.name].keys()]
