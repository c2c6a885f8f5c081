"""What a broken rule of the safety core means to people at the bench, and what they can do."""

from typing import NamedTuple

from hil.safety.cycle import Reaction


class Advice(NamedTuple):
    """In plain words: what happened, and what to do about it."""

    happened: str
    do: str


ADVICE = {
    "finite_command": Advice(
        "The controller failed: it asked for what is no torque.",
        "Read the controller's own error in the session's result, repair it, start again.",
    ),
    "positions_answered": Advice(
        "A motor did not say in time where it is.",
        "Look at plugs, termination and load of the bus; `misfit hil check` names a node that is missing.",
    ),
    "encoder_alive": Advice(
        "An encoder has stopped: its joint is pushed and the angle does not change by a single count.",
        "Look at the encoder and its cable before the arm is used again.",
    ),
    "on_time": Advice(
        "The session did not keep its time.",
        "Free the computer of other work, permit real-time priority (docs/bench.md), or use a lower rate.",
    ),
    "encoder_steady": Advice(
        "An encoder says that its joint jumped.",
        "Look at the encoder's cable and supply; zero the arm on its stops again.",
    ),
    "torque_acts": Advice(
        "A joint does not follow the torque that is sent to it.",
        "Is it blocked, or held beside the force sensor? If it is free, check its motor's cable and its encoder.",
    ),
    "model_explains": Advice(
        "The arm moves otherwise than its model, with all that was learned, can explain.",
        "Was it held elsewhere than at the wrist? If not, check motors, encoders and the weight; a model that is far off needs a larger `disagreement`.",
    ),
    "motion_explained": Advice(
        "A joint moved by itself: neither its torque nor a push at the wrist explains it.",
        "Was the arm pushed elsewhere than at the wrist? If not, do not arm it again before its motor and weight are checked.",
    ),
    "speed_limited": Advice(
        "A joint moved faster than it may.",
        "Was the arm thrown or pushed? If nobody did, do not arm it again before the controller is understood.",
    ),
    "inside_range": Advice(
        "A joint is outside its range of motion.",
        "Bring the arm back by hand. If it stands well inside, its zero is wrong: zero it on its stops.",
    ),
    "energy_bounded": Advice(
        "The arm gave more energy than it may to whoever holds it.",
        "Ask the controller for less stiffness or speed; the limit is `energy` of the bench file.",
    ),
    "force_bounded": Advice(
        "The force at the wrist is too large, or its sensor cannot be believed.",
        "Let go of the arm. If nobody held it, zero the force sensor and look at its cable.",
    ),
    "cool": Advice("A motor is getting hot.", "Let the arm rest; ask for less torque in long holds."),
    "unpinched": Advice(
        "A joint presses against something where it can pinch.", "Look between the links; free what is there."
    ),
    "calm": Advice(
        "The torque swings to and fro: controller and arm excite each other.",
        "Ask for less stiffness or more damping; hold the arm less tightly.",
    ),
    "module_agrees": Advice(
        "The robot's own safety module, or its pendant, has switched the torque off.",
        "Find out who pressed and why; release the emergency stop, press Activate, start a new session.",
    ),
    "drives_ready": Advice(
        "A drive has left its operation: it has a fault, or somebody disabled it.",
        "Look up its error, remove the cause, start a new session.",
    ),
    "alone_on_the_bus": Advice(
        "Another program sends torques to this robot.", "End the other program; only one may command an arm."
    ),
    "watched": Advice(
        "The session stood still and the watchdog has let the arm go.",
        "Free the computer of other work; the arm sinks slowly, nothing drives it.",
    ),
    "recorded": Advice(
        "What happens can no longer be recorded.", "Is the disk full? Make room and start a new session."
    ),
    "not_aborted": Advice(
        "Somebody stopped the session: the button, Ctrl-C, or the end of its terminal.",
        "Start a new session when all is clear.",
    ),
    "not_ended": Advice("The session came to its end.", "Nothing needs to be done."),
}

REACTIONS = {
    Reaction.PASS: "nothing: torques pass",
    Reaction.REDUCE: "half torque while it lasted",
    Reaction.COMPLY: "the arm gave way: torque faded in a second, its weight was held",
    Reaction.SUPPORT: "only the arm's weight was held",
    Reaction.RELEASE: "no torque: motors idle, they brake by themselves",
    Reaction.SILENCE: "nothing was sent any more: somebody else has switched the robot off",
}
