/* FMI 3.0 functions that every FMU has to export, for what a container alone does not have. */
#include "fmi3_container.h"

#define NOT_PROVIDED "not provided by this FMU"

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken, fmi3String
                                          resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback
                                          logMessage)
{
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    Instance importer = {NULL, instanceEnvironment, logMessage};
    layer_refuse(&importer, __func__, "this FMU knows co-simulation only");
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken, fmi3String
                                               resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback
                                               logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption, fmi3UnlockPreemptionCallback
                                               unlockPreemption)
{
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn,
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    Instance importer = {NULL, instanceEnvironment, logMessage};
    layer_refuse(&importer, __func__, "this FMU knows co-simulation only");
    return NULL;
}

static fmi3Status none(Instance *self, const char *call, size_t count)
{
    return count == 0 ? fmi3OK : layer_refuse(self, call, "there is no variable of this type");
}

#define NO_VARIABLES(name, parameters)                                                                                       \
    fmi3Status fmi3##name parameters { return none(instance, __func__, nValueReferences); }

NO_VARIABLES(GetUInt64, (fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         fmi3UInt64 values[], size_t nValues))
NO_VARIABLES(GetBinary, (fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, size_t
                         valueSizes[], fmi3Binary values[], size_t nValues))
NO_VARIABLES(GetClock, (fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Clock values[]))
NO_VARIABLES(SetUInt64, (fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, const
                         fmi3UInt64 values[], size_t nValues))
NO_VARIABLES(SetBinary, (fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, const
                         size_t valueSizes[], const fmi3Binary values[], size_t nValues))
NO_VARIABLES(SetClock, (fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, const
                        fmi3Clock values[]))

ABSENT(EnterEventMode, (fmi3Instance instance), instance, NOT_PROVIDED)
ABSENT(GetDirectionalDerivative, (fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns, const
        fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[],
        size_t nSensitivity), instance, NOT_PROVIDED)
ABSENT(GetAdjointDerivative, (fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns, const
        fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[],
        size_t nSensitivity), instance, NOT_PROVIDED)
ABSENT(UpdateDiscreteStates, (fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean
        *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
        fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime), instance, NOT_PROVIDED)
ABSENT(EnterContinuousTimeMode, (fmi3Instance instance), instance, NOT_PROVIDED)
ABSENT(CompletedIntegratorStep, (fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean
        *enterEventMode, fmi3Boolean *terminateSimulation), instance, NOT_PROVIDED)
ABSENT(SetTime, (fmi3Instance instance, fmi3Float64 time), instance, NOT_PROVIDED)
ABSENT(SetContinuousStates, (fmi3Instance instance, const fmi3Float64 continuousStates[], size_t nContinuousStates),
        instance, NOT_PROVIDED)
ABSENT(GetContinuousStateDerivatives, (fmi3Instance instance, fmi3Float64 derivatives[], size_t nContinuousStates),
        instance, NOT_PROVIDED)
ABSENT(GetEventIndicators, (fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators), instance,
        NOT_PROVIDED)
ABSENT(GetContinuousStates, (fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates), instance,
        NOT_PROVIDED)
ABSENT(GetNominalsOfContinuousStates, (fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates), instance,
        NOT_PROVIDED)
ABSENT(GetNumberOfEventIndicators, (fmi3Instance instance, size_t *nEventIndicators), instance, NOT_PROVIDED)
ABSENT(GetNumberOfContinuousStates, (fmi3Instance instance, size_t *nContinuousStates), instance, NOT_PROVIDED)
ABSENT(EnterStepMode, (fmi3Instance instance), instance, NOT_PROVIDED)
