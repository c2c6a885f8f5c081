/* The functions of FMI 3.0 that station.c does not need and every FMU has to export: each is an error. */
#define ABSENT(name) \
    int fmi3##name(void) { return 3; }
#define NUMBERS(of) of(Float32) of(Int8) of(UInt8) of(Int16) of(UInt16) of(Int32) of(UInt32) of(Int64) of(UInt64) of(Boolean) of(String)
#define BOTH(type) ABSENT(Get##type) ABSENT(Set##type)

NUMBERS(BOTH)
BOTH(FMUState) BOTH(ShiftDecimal) BOTH(ShiftFraction) BOTH(IntervalFraction) BOTH(ContinuousStates)
ABSENT(ActivateModelPartition) ABSENT(CompletedIntegratorStep) ABSENT(DeserializeFMUState) ABSENT(EnterConfigurationMode)
ABSENT(EnterContinuousTimeMode) ABSENT(EvaluateDiscreteStates) ABSENT(ExitConfigurationMode) ABSENT(FreeFMUState)
ABSENT(GetAdjointDerivative) ABSENT(GetContinuousStateDerivatives) ABSENT(GetDirectionalDerivative) ABSENT(GetEventIndicators)
ABSENT(GetNominalsOfContinuousStates) ABSENT(GetNumberOfContinuousStates) ABSENT(GetNumberOfEventIndicators)
ABSENT(GetNumberOfVariableDependencies) ABSENT(GetOutputDerivatives) ABSENT(GetVariableDependencies) ABSENT(GetVersion)
ABSENT(InstantiateModelExchange) ABSENT(InstantiateScheduledExecution) ABSENT(Reset) ABSENT(SerializeFMUState)
ABSENT(SerializedFMUStateSize) ABSENT(SetDebugLogging) ABSENT(SetIntervalDecimal) ABSENT(SetTime)
