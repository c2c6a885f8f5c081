/* FMI 3.0 functions that every FMU has to export, for abilities that no FMU of ours has; containers have this file too. */
#include "fmi.h"

#define REFERENCES const fmi3ValueReference valueReferences[], size_t nValueReferences
#define NO_CLOCKS "this FMU has no clocks"
#define IN_DESCRIPTION "not provided by this FMU; its dependencies are in modelDescription.xml"
#define NO_STRUCTURE "this FMU has no structural parameters"

ABSENT(GetOutputDerivatives,
       (fmi3Instance instance, REFERENCES, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues), instance,
       "not provided by this FMU")
ABSENT(GetNumberOfVariableDependencies,
       (fmi3Instance instance, fmi3ValueReference valueReference, size_t *nDependencies), instance, IN_DESCRIPTION)
ABSENT(GetVariableDependencies,
       (fmi3Instance instance, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
        fmi3ValueReference independents[], size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
        size_t nDependencies), instance, IN_DESCRIPTION)
ABSENT(EnterConfigurationMode, (fmi3Instance instance), instance, NO_STRUCTURE)
ABSENT(ExitConfigurationMode, (fmi3Instance instance), instance, NO_STRUCTURE)
ABSENT(EvaluateDiscreteStates, (fmi3Instance instance), instance, "this FMU has no discrete states")
ABSENT(GetIntervalDecimal,
       (fmi3Instance instance, REFERENCES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]), instance, NO_CLOCKS)
ABSENT(GetIntervalFraction,
       (fmi3Instance instance, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
        fmi3IntervalQualifier qualifiers[]), instance, NO_CLOCKS)
ABSENT(GetShiftDecimal, (fmi3Instance instance, REFERENCES, fmi3Float64 shifts[]), instance, NO_CLOCKS)
ABSENT(GetShiftFraction,
       (fmi3Instance instance, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[]), instance, NO_CLOCKS)
ABSENT(SetIntervalDecimal, (fmi3Instance instance, REFERENCES, const fmi3Float64 intervals[]), instance, NO_CLOCKS)
ABSENT(SetIntervalFraction,
       (fmi3Instance instance, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]), instance, NO_CLOCKS)
ABSENT(SetShiftDecimal, (fmi3Instance instance, REFERENCES, const fmi3Float64 shifts[]), instance, NO_CLOCKS)
ABSENT(SetShiftFraction,
       (fmi3Instance instance, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]), instance, NO_CLOCKS)
ABSENT(ActivateModelPartition,
       (fmi3Instance instance, fmi3ValueReference clockReference, fmi3Float64 activationTime), instance, NO_CLOCKS)
