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
        "Look at plugs, termination and load of the bus; `misfit hil check` names a node that is missing. A virtual robot needs a computer that does little else, or a lower rate.",
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
        "Ask for less stiffness, speed or activation of muscles; the limit is `energy` of the bench file.",
    ),
    "force_bounded": Advice(
        "The force at the wrist is too large.", "Let go of the arm. If nobody held it, zero the force sensor."
    ),
    "cool": Advice("A motor is too hot.", "Let the arm rest; ask for less torque in long holds."),
    "unpinched": Advice(
        "A joint presses against something where it can pinch.", "Look between the links; free what is there."
    ),
    "calm": Advice(
        "The torque swings to and fro: controller and arm excite each other.",
        "Ask for less stiffness or more damping; hold the arm less tightly.",
    ),
    "module_agrees": Advice(
        "The robot's own safety module has switched the torque off.",
        "Look at the pendant: Idle was pressed, or a limit was passed. Find its cause; press Activate, start a new session.",
    ),
    "drives_ready": Advice(
        "A drive has left its operation.",
        "Look up its error, remove the cause, start a new session.",
    ),
    "alone_on_the_bus": Advice(
        "Another program sends torques to this robot.", "End the other program; only one may command an arm."
    ),
    "watched": Advice(
        "The watchdog has let the arm go.",
        "Free the computer of other work; the arm sinks slowly, nothing drives it.",
    ),
    "recorded": Advice(
        "What happens can no longer be recorded.", "Is the disk full? Make room and start a new session."
    ),
    "not_aborted": Advice(
        "Somebody stopped the session.",
        "Start a new session when all is clear.",
    ),
    "not_ended": Advice("The session came to its end.", "Nothing needs to be done."),
}

# A rule that can be broken in several ways: words of the safety core, and what is meant by them.
CAUSES = {
    "encoder_alive": (("right after", Advice("An encoder has stopped at once.", ADVICE["encoder_alive"].do)),),
    "positions_answered": (
        ("too late", Advice("A motor says too late where it is.", ADVICE["positions_answered"].do)),
    ),
    "on_time": (
        ("stood still", Advice("The session stood still.", ADVICE["on_time"].do)),
        ("clock moved", Advice("The computer's clock jumped.", "Look for what sets the clock; start a new session.")),
    ),
    "force_bounded": (
        (
            "sensor has not answered",
            Advice("The force sensor is silent.", "Look at its cable and supply, and at the load of the bus."),
        ),
        (
            "no force sensor",
            Advice("There is no force sensor.", "`misfit hil check` names nodes that are missing."),
        ),
        (
            "beyond its range",
            Advice("The force sensor is at the end of its range.", "Let go of the arm; zero the force sensor."),
        ),
        (
            "exactly the same",
            Advice("The force sensor has stopped: it repeats itself to the last digit.", "Look at it and its cable."),
        ),
    ),
    "cool": (("getting hot", Advice("A motor is getting hot.", ADVICE["cool"].do)),),
    "module_agrees": (
        (
            "emergency stop",
            Advice(
                "The emergency stop was pressed.",
                "Find out who pressed and why; release it, press Activate, start a new session.",
            ),
        ),
        (
            "does not answer",
            Advice("The robot's safety module is silent.", "Look at its cable and supply, and at the bus."),
        ),
        ("no safety module", Advice("There is no safety module.", "`misfit hil check` names nodes that are missing.")),
        ("warns", Advice("The robot's safety module warns.", "Look at the pendant: a limit of it is near.")),
    ),
    "watched": (("fallen silent", Advice("The watchdog is silent.", ADVICE["watched"].do)),),
}


def advice(rule: str, words: str) -> Advice:
    """What a broken rule means, by the words in which the safety core says how it was broken."""
    return next((meant for part, meant in CAUSES.get(rule, ()) if part in words), ADVICE[rule])


REACTIONS = {
    Reaction.PASS: "nothing: torques pass",
    Reaction.REDUCE: "half torque while it lasted",
    Reaction.COMPLY: "the arm gave way: torque faded in a second, its weight was held",
    Reaction.SUPPORT: "only the arm's weight was held",
    Reaction.RELEASE: "no torque: motors idle, they brake by themselves",
    Reaction.SILENCE: "nothing was sent any more: somebody else has switched the robot off",
}
