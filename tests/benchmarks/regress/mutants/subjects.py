"""What is mutated: the arm, a muscle, a drive and two tanks, with effects in their slots so that every operator finds a place."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Level:
    """An input that takes a new level, drawn from [low, high], every `hold_s` seconds."""

    low: float
    high: float
    hold_s: float


@dataclass(frozen=True)
class Subject:
    """A model under test and how its case drives it.

    `text` is the Modelica class `name`; `files` are the library's sources that it is made of, relative to the library;
    `outputs` are compared, each within an absolute tolerance in its own unit and 0.1 % of the reference's range.
    """

    name: str
    text: str
    files: tuple[str, ...]
    outputs: dict[str, float]
    inputs: dict[str, Level]
    stop_s: float
    step_s: float

    def input_table(self) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Stamps (s) and values of all inputs; a stamp that occurs twice is a jump."""
        shortest = min(level.hold_s for level in self.inputs.values())
        edges = np.arange(round(self.stop_s / shortest) + 1) * shortest
        time = np.repeat(edges, 2)[1:-1]
        columns = {}
        for k, (name, level) in enumerate(self.inputs.items()):
            random = np.random.default_rng([k, len(self.name)])
            count = round(self.stop_s / level.hold_s) + 1
            levels = np.round(random.uniform(level.low, level.high, count), 4)
            places = np.floor(edges[:-1] / level.hold_s + 1e-9).astype(int)
            columns[name] = np.repeat(levels[places], 2)
        return time, columns


RELATIVE = 1e-3

DRIVE = Subject(
    name="ServoDrive",
    text="""model ServoDrive "Drive with friction, an elastic shaft, an end stop, and a limited and late motor"
  extends FESArm.Plants.Drive(
    redeclare model JointTorque1 = FESArm.Effects.JointTorque.CoulombFriction,
    jointTorque1(tauC={0.03}, wSharp=0.05),
    redeclare model JointTorque2 = FESArm.Effects.JointTorque.EndStopAbove,
    jointTorque2(k={5}, qStop={-0.4}),
    redeclare model JointTorque3 = FESArm.Effects.JointTorque.ViscousFriction,
    jointTorque3(b={0.12}),
    redeclare model JointSensor1 = FESArm.Effects.JointSensor.SensorLag,
    jointSensor1(tau=0.03),
    redeclare model Actuator1 = FESArm.Effects.Actuator.ActuatorSaturation,
    actuator1(ceiling=0.5),
    redeclare model Actuator2 = FESArm.Effects.Actuator.ActuatorDelay,
    actuator2(T=0.01),
    redeclare model Transmission1 = FESArm.Effects.Transmission.JointElasticity,
    transmission1(k=20, d=0.05, share=0.4));
end ServoDrive;
""",
    files=(
        "Plants/Drive.mo",
        "Effects/JointTorque/CoulombFriction.mo",
        "Effects/JointTorque/PartialEndStop.mo",
        "Effects/JointTorque/EndStopAbove.mo",
        "Effects/JointTorque/ViscousFriction.mo",
        "Effects/JointSensor/SensorLag.mo",
        "Effects/Actuator/ActuatorSaturation.mo",
        "Effects/Actuator/ActuatorDelay.mo",
        "Effects/Transmission/JointElasticity.mo",
    ),
    outputs={"phi": 1e-5, "q": 1e-5, "w": 1e-4},
    inputs={"torque": Level(-0.62, 0.8, 0.2), "correction_phi": Level(-0.1, 0.1, 0.5)},
    stop_s=5.0,
    step_s=0.002,
)

TANKS = Subject(
    name="LeakyTanks",
    text="""model LeakyTanks "Two tanks with a leak, an outlet that differs, a limited and late pump, and a slow level sensor"
  extends FESArm.Plants.TwoTanks(
    level1(start=0.25),
    level2(start=0.12),
    redeclare model Inflow1 = FESArm.Effects.Inflow.InflowCeiling,
    inflow1(ceiling=1.5e-4),
    redeclare model Inflow2 = FESArm.Effects.Inflow.InflowDelay,
    inflow2(T=2),
    redeclare model TankFlow1 = FESArm.Effects.TankFlow.TankLeak,
    tankFlow1(leak={1e-5, 2e-5}),
    redeclare model TankFlow2 = FESArm.Effects.TankFlow.OutletError,
    tankFlow2(factor={1.2, 0.9}),
    redeclare model LevelSensor1 = FESArm.Effects.LengthSensor.LengthLag,
    levelSensor1(tau=1.5));
end LeakyTanks;
""",
    files=(
        "Plants/TwoTanks.mo",
        "Effects/Inflow/InflowCeiling.mo",
        "Effects/Inflow/InflowDelay.mo",
        "Effects/TankFlow/TankLeak.mo",
        "Effects/TankFlow/OutletError.mo",
        "Effects/LengthSensor/LengthLag.mo",
    ),
    outputs={"h1": 1e-5, "h2": 1e-5, "outflow": 1e-8},
    inputs={
        "inflow": Level(0.0, 2.5e-4, 10.0),
        "correction_h1": Level(-1e-5, 1e-5, 30.0),
        "correction_h2": Level(-1e-5, 1e-5, 20.0),
        "correction_outflow": Level(-1e-5, 1e-5, 60.0),
    },
    stop_s=300.0,
    step_s=0.5,
)

MUSCLE = Subject(
    name="TiringMuscle",
    text="""model TiringMuscle "Isometric muscle with late, limited and lagging recruitment, that tires"
  extends FESArm.Isometric.IsometricMuscle(
    redeclare model StimulationPath1 = FESArm.Effects.StimulationPath.StimulationDelay,
    stimulationPath1(T=0.02),
    redeclare model StimulationPath2 = FESArm.Effects.StimulationPath.RecruitmentCurve,
    stimulationPath2(threshold=0.1, full=0.9),
    redeclare model StimulationPath3 = FESArm.Effects.StimulationPath.ActivationDynamics,
    stimulationPath3(tauUp=0.03, tauDown=0.06),
    redeclare model MuscleStrength1 = FESArm.Effects.MuscleStrength.Fatigue,
    muscleStrength1(TFatigue=3, TRecovery=8));
end TiringMuscle;
""",
    files=(
        "Isometric/IsometricMuscle.mo",
        "Isometric/equilibriumForce.mo",
        "Effects/StimulationPath/StimulationDelay.mo",
        "Effects/StimulationPath/ChannelDelay.mo",
        "Effects/StimulationPath/RecruitmentCurve.mo",
        "Effects/StimulationPath/ActivationDynamics.mo",
        "Effects/MuscleStrength/Fatigue.mo",
    ),
    outputs={"force": 1e-3},
    inputs={
        "stimulation": Level(0.0, 1.0, 0.1),
        "length": Level(0.041, 0.051, 1.0),
        "correction_force": Level(-0.5, 0.5, 0.5),
    },
    stop_s=4.0,
    step_s=0.002,
)

ARM = Subject(
    name="LoadedArm",
    text="""model LoadedArm "The arm with a payload, friction, late and lagging stimulation, and a tilted plane"
  extends FESArm.Arms.Arm(
    redeclare model StimulationPath1 = FESArm.Effects.StimulationPath.StimulationDelay,
    stimulationPath1(T=0.02),
    redeclare model StimulationPath2 = FESArm.Effects.StimulationPath.Saturation,
    stimulationPath2(ceiling=0.5),
    redeclare model StimulationPath3 = FESArm.Effects.StimulationPath.ActivationDynamics,
    redeclare model JointTorque1 = FESArm.Effects.JointTorque.CoulombFriction,
    jointTorque1(tauC={0.1, 0.08}, wSharp=0.05),
    redeclare model WristLoad1 = FESArm.Effects.WristLoad.Payload,
    wristLoad1(mass=0.3),
    redeclare model Field1 = FESArm.Effects.Field.GravityTilt,
    field1(gx=0.4, gy=-0.3));
end LoadedArm;
""",
    files=(
        "Arms/PartialArm.mo",
        "Arms/Arm.mo",
        "Linkage/PlanarLinkage.mo",
        "Muscles/PartialHillMuscle.mo",
        "Muscles/RigidTendonMuscle.mo",
        "Muscles/forceLength.mo",
        "Muscles/forceVelocity.mo",
        "Effects/StimulationPath/ChannelDelay.mo",
        "Effects/StimulationPath/Saturation.mo",
        "Effects/StimulationPath/ActivationDynamics.mo",
        "Effects/JointTorque/CoulombFriction.mo",
        "Effects/WristLoad/Payload.mo",
        "Effects/Field/GravityTilt.mo",
    ),
    outputs={"q1": 1e-5, "q2": 1e-5},
    inputs={
        "alpha_1": Level(0.0, 0.7, 0.4),
        "alpha_2": Level(0.0, 0.7, 0.4),
        "alpha_3": Level(0.0, 0.3, 0.4),
        "alpha_4": Level(0.0, 0.7, 0.4),
        "alpha_5": Level(0.0, 0.7, 0.4),
        "alpha_6": Level(0.0, 0.4, 0.4),
        "fx": Level(-4.0, 4.0, 0.4),
        "fy": Level(-4.0, 4.0, 0.4),
        "correction_q1": Level(-0.2, 0.2, 0.8),
        "correction_q2": Level(-0.2, 0.2, 0.8),
    },
    stop_s=4.0,
    step_s=0.004,
)

SUBJECTS = {subject.name: subject for subject in (ARM, MUSCLE, DRIVE, TANKS)}
