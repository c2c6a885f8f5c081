"""Functions of the FMI standards: their arguments, and the phases that allow them.

Sources: FMI 2.0.4, sections 3.2.3 and 4.2.4; FMI 3.0.1, sections 2.3, 3.2 and 4.2.
"""

from collections.abc import Mapping
from dataclasses import dataclass

INSTANTIATED, INITIALIZATION, EVENT, CONTINUOUS, STEP, TERMINATED = (
    "instantiated",
    "initialization",
    "event",
    "continuous",
    "step",
    "terminated",
)
EXCHANGE = (INSTANTIATED, INITIALIZATION, EVENT, CONTINUOUS, TERMINATED)
STEPPING = (INSTANTIATED, INITIALIZATION, STEP, TERMINATED)

Phases = Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class Table:
    """One version; `arguments` by function, as kinds of `Calls.values`; `harmless` variants are right after all."""

    prefix: str
    arguments: Mapping[str, tuple[str, ...]]
    allowed: Mapping[str, Phases]
    harmless: frozenset[tuple[str, str, int]]

    @property
    def phases(self) -> list[tuple[str, str]]:
        """Interface type and phase, all that there are."""
        return [*(("exchange", phase) for phase in EXCHANGE), *(("stepping", phase) for phase in STEPPING)]

    def way(self, kind: str, phase: str, event_mode: bool) -> list[str]:
        """Functions that lead to a phase."""
        calls = []
        if phase != INSTANTIATED:
            calls.append("EnterInitializationMode")
        if phase not in (INSTANTIATED, INITIALIZATION):
            calls.append("ExitInitializationMode")
        if phase == CONTINUOUS:
            calls += ["NewDiscreteStates" if self.prefix == "fmi2" else "UpdateDiscreteStates"]
            calls.append("EnterContinuousTimeMode")
        if phase == STEP and event_mode:
            calls.append("EnterStepMode")
        if phase == TERMINATED:
            calls.append("Terminate")
        return [self.prefix + call for call in calls]


def _always() -> Phases:
    return {"exchange": EXCHANGE, "stepping": STEPPING}


def _both(*phases: str) -> Phases:
    return {
        "exchange": tuple(p for p in phases if p in EXCHANGE),
        "stepping": tuple(p for p in phases if p in STEPPING),
    }


def _exchange(*phases: str) -> Phases:
    return {"exchange": phases}


_VALUES = _both(INITIALIZATION, EVENT, CONTINUOUS, STEP, TERMINATED)
_SETTING = _both(INSTANTIATED, INITIALIZATION, EVENT, CONTINUOUS, STEP)
_DERIVATIVES = ("unknown", "one", "known", "one", "value", "room")

FMI2 = Table(
    "fmi2",
    {
        "fmi2SetDebugLogging": ("true", "one", "categories"),
        "fmi2SetupExperiment": ("true", "tolerance", "start", "true", "stop"),
        "fmi2EnterInitializationMode": (),
        "fmi2ExitInitializationMode": (),
        "fmi2Terminate": (),
        "fmi2Reset": (),
        "fmi2GetReal": ("outputs", "one", "room"),
        "fmi2SetReal": ("inputs", "one", "value"),
        "fmi2GetInteger": ("outputs", "none", "space"),
        "fmi2SetRealInputDerivatives": ("inputs", "one", "orders", "value"),
        "fmi2GetRealOutputDerivatives": ("outputs", "one", "orders", "room"),
        "fmi2GetDirectionalDerivative": _DERIVATIVES,
        "fmi2GetFMUstate": ("new_state",),
        "fmi2SetFMUstate": ("state",),
        "fmi2FreeFMUstate": ("no_state",),
        "fmi2SerializedFMUstateSize": ("state", "size"),
        "fmi2SerializeFMUstate": ("state", "bytes", "byte_count"),
        "fmi2DeSerializeFMUstate": ("bytes", "byte_count", "new_state"),
        "fmi2DoStep": ("now", "step", "true"),
        "fmi2CancelStep": (),
        "fmi2GetRealStatus": ("successful", "room"),
        "fmi2GetBooleanStatus": ("terminated", "flag"),
        "fmi2EnterEventMode": (),
        "fmi2NewDiscreteStates": ("info",),
        "fmi2EnterContinuousTimeMode": (),
        "fmi2CompletedIntegratorStep": ("true", "flag", "flag"),
        "fmi2SetTime": ("time",),
        "fmi2SetContinuousStates": ("value", "state_count"),
        "fmi2GetContinuousStates": ("room", "state_count"),
        "fmi2GetDerivatives": ("room", "state_count"),
        "fmi2GetNominalsOfContinuousStates": ("room", "state_count"),
        "fmi2GetEventIndicators": ("space", "indicator_count"),
    },
    {
        "fmi2SetDebugLogging": _always(),
        "fmi2SetupExperiment": _both(INSTANTIATED),
        "fmi2EnterInitializationMode": _both(INSTANTIATED),
        "fmi2ExitInitializationMode": _both(INITIALIZATION),
        "fmi2Terminate": _both(STEP, EVENT, CONTINUOUS),
        "fmi2Reset": _always(),
        "fmi2GetReal": _VALUES,
        "fmi2SetReal": _SETTING,
        "fmi2GetInteger": _always(),
        "fmi2SetRealInputDerivatives": _both(INSTANTIATED, INITIALIZATION, STEP),
        "fmi2GetRealOutputDerivatives": {},
        "fmi2GetDirectionalDerivative": _VALUES,
        "fmi2GetFMUstate": _always(),
        "fmi2FreeFMUstate": _always(),
        "fmi2DoStep": _both(STEP),
        "fmi2CancelStep": {},
        "fmi2GetRealStatus": {"exchange": (TERMINATED,), "stepping": (STEP, TERMINATED)},
        "fmi2GetBooleanStatus": {"exchange": (TERMINATED,), "stepping": (STEP, TERMINATED)},
        "fmi2EnterEventMode": _exchange(EVENT, CONTINUOUS),
        "fmi2NewDiscreteStates": _exchange(EVENT),
        "fmi2EnterContinuousTimeMode": _exchange(EVENT),
        "fmi2CompletedIntegratorStep": _exchange(CONTINUOUS),
        "fmi2SetTime": _exchange(EVENT, CONTINUOUS),
        "fmi2SetContinuousStates": _exchange(EVENT, CONTINUOUS),
        "fmi2GetContinuousStates": _both(INITIALIZATION, EVENT, CONTINUOUS),
        "fmi2GetDerivatives": _both(INITIALIZATION, EVENT, CONTINUOUS),
        "fmi2GetNominalsOfContinuousStates": _both(INSTANTIATED, INITIALIZATION, EVENT, CONTINUOUS)
        | {"stepping": (INSTANTIATED, INITIALIZATION, STEP)},
        "fmi2GetEventIndicators": _both(INITIALIZATION, EVENT, CONTINUOUS),
    },
    # An empty list needs no references; without a stop time a step may be long.
    frozenset({("fmi2GetInteger", "outputs", 1), ("fmi2GetInteger", "outputs", 2), ("fmi2DoStep", "step", 4)}),
)

FMI3 = Table(
    "fmi3",
    {
        "fmi3SetDebugLogging": ("true", "one", "categories"),
        "fmi3EnterInitializationMode": ("true", "tolerance", "start", "true", "stop"),
        "fmi3ExitInitializationMode": (),
        "fmi3EnterEventMode": (),
        "fmi3EnterStepMode": (),
        "fmi3Terminate": (),
        "fmi3Reset": (),
        "fmi3GetFloat64": ("outputs", "one", "room", "one"),
        "fmi3SetFloat64": ("inputs", "one", "value", "one"),
        "fmi3GetInt32": ("outputs", "none", "space", "none"),
        "fmi3GetDirectionalDerivative": ("unknown", "one", "known", "one", "value", "one", "room", "one"),
        "fmi3GetAdjointDerivative": ("unknown", "one", "known", "one", "value", "one", "room", "one"),
        "fmi3GetFMUState": ("new_state",),
        "fmi3SetFMUState": ("state",),
        "fmi3FreeFMUState": ("no_state",),
        "fmi3SerializedFMUStateSize": ("state", "size"),
        "fmi3SerializeFMUState": ("state", "bytes", "byte_count"),
        "fmi3DeserializeFMUState": ("bytes", "byte_count", "new_state"),
        "fmi3DoStep": ("now", "step", "true", "flag", "flag", "flag", "room"),
        "fmi3UpdateDiscreteStates": ("flag", "flag", "flag", "flag", "flag", "room"),
        "fmi3EnterContinuousTimeMode": (),
        "fmi3CompletedIntegratorStep": ("true", "flag", "flag"),
        "fmi3SetTime": ("time",),
        "fmi3SetContinuousStates": ("value", "state_count"),
        "fmi3GetContinuousStates": ("room", "state_count"),
        "fmi3GetContinuousStateDerivatives": ("room", "state_count"),
        "fmi3GetNominalsOfContinuousStates": ("room", "state_count"),
        "fmi3GetEventIndicators": ("space", "indicator_count"),
        "fmi3GetNumberOfEventIndicators": ("size",),
        "fmi3GetNumberOfContinuousStates": ("size",),
        "fmi3EnterConfigurationMode": (),
    },
    {
        "fmi3SetDebugLogging": _always(),
        "fmi3EnterInitializationMode": _both(INSTANTIATED),
        "fmi3ExitInitializationMode": _both(INITIALIZATION),
        "fmi3Terminate": _both(STEP, EVENT, CONTINUOUS),
        "fmi3Reset": _always(),
        "fmi3GetFloat64": _VALUES,
        "fmi3SetFloat64": _SETTING,
        "fmi3GetInt32": _always(),
        "fmi3GetDirectionalDerivative": _VALUES,
        "fmi3GetAdjointDerivative": _VALUES,
        "fmi3GetFMUState": _always(),
        "fmi3FreeFMUState": _always(),
        "fmi3DoStep": _both(STEP),
        "fmi3UpdateDiscreteStates": _exchange(EVENT),
        "fmi3EnterContinuousTimeMode": _exchange(EVENT),
        "fmi3CompletedIntegratorStep": _exchange(CONTINUOUS),
        "fmi3SetTime": _exchange(EVENT, CONTINUOUS),
        "fmi3SetContinuousStates": _exchange(EVENT, CONTINUOUS),
        "fmi3GetContinuousStates": _exchange(INITIALIZATION, EVENT, CONTINUOUS),
        "fmi3GetContinuousStateDerivatives": _exchange(INITIALIZATION, EVENT, CONTINUOUS),
        "fmi3GetNominalsOfContinuousStates": _exchange(INSTANTIATED, INITIALIZATION, EVENT, CONTINUOUS),
        "fmi3GetEventIndicators": _exchange(INITIALIZATION, EVENT, CONTINUOUS),
        "fmi3GetNumberOfEventIndicators": _always(),
        "fmi3GetNumberOfContinuousStates": _always(),
        "fmi3EnterConfigurationMode": {},
    },
    frozenset({("fmi3GetInt32", "outputs", 1), ("fmi3GetInt32", "outputs", 2)}),
)
