// The functions of FMI 3.0 for an instance of the mechanism. Types as in the standard: Modelica Association, Functional Mock-up
// Interface Specification 3.0, sections 2.2 to 4.2.
#include <stdbool.h>
#include <stdint.h>

#include "instance.h"

typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef double fmi3Float64;
typedef float fmi3Float32;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum { fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent } fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef void fmi3LogMessageCallback(fmi3InstanceEnvironment, fmi3Status, fmi3String category, fmi3String message);
typedef void fmi3ClockUpdateCallback(fmi3InstanceEnvironment);
typedef void fmi3LockPreemptionCallback(void);
typedef void fmi3IntermediateUpdateCallback(fmi3InstanceEnvironment, fmi3Float64 time, fmi3Boolean set_requested,
    fmi3Boolean get_allowed, fmi3Boolean step_finished, fmi3Boolean can_return_early, fmi3Boolean *return_requested,
    fmi3Float64 *return_time);

#if defined(_WIN32)
#define FMI3_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI3_EXPORT __attribute__((visibility("default")))
#else
#define FMI3_EXPORT
#endif
// Sources that are linked with others have names with a prefix, as the standard asks.
#ifdef FMI3_FUNCTION_PREFIX
#define FMI3_JOINED(prefix, name) prefix##name
#define FMI3_WITH(prefix, name) FMI3_JOINED(prefix, name)
#define FMI3_NAME(name) FMI3_WITH(FMI3_FUNCTION_PREFIX, name)
#else
#define FMI3_NAME(name) name
#endif
#define FMI3(name) FMI3_EXPORT fmi3Status FMI3_NAME(name)

static void fmu_log(fmu_instance *f, int failed, const char *message) {
    if (f->log)
        ((fmi3LogMessageCallback *)f->log)(
            f->environment, failed ? fmi3Error : fmi3Warning, failed ? "logStatusError" : "logStatusWarning", message);
}

static fmi3Status status_of(int code) { return code == FMU_FAILED ? fmi3Error : fmi3OK; }

static fmi3Status unsupported(fmi3Instance instance, const char *what) {
    fmu_fail(instance, what, "this FMU does not have it");
    return fmi3Error;
}

FMI3_EXPORT const char *FMI3_NAME(fmi3GetVersion)(void) { return "3.0"; }

FMI3(fmi3SetDebugLogging)(fmi3Instance instance, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    (void)instance;
    (void)on;
    (void)n;
    (void)categories;
    return fmi3OK;  // what is logged are errors and warnings
}

static fmi3Instance instantiated(
    fmi3String name, fmi3String token, fmi3InstanceEnvironment environment, fmi3LogMessageCallback *log, int model_exchange) {
    fmu_instance *const f = model_exchange == FMU_MODEL_EXCHANGE ? fmu_new(name, token) : NULL;
    if (!f) {
        if (log) log(environment, fmi3Error, "logStatusError", "no instance: the token or the kind is that of another FMU");
        return NULL;
    }
    f->environment = environment;
    f->log = (void (*)(void))log;
    return f;
}

FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateModelExchange)(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback *log) {
    (void)resources;
    (void)visible;
    (void)logging;
    return instantiated(name, token, environment, log, 1);
}

FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateCoSimulation)(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
    const fmi3ValueReference intermediate[], size_t n_intermediate, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback *log, fmi3IntermediateUpdateCallback *update) {
    (void)resources;
    (void)visible;
    (void)logging;
    (void)event_mode;
    (void)intermediate;
    (void)n_intermediate;
    (void)update;
    fmu_instance *const f = instantiated(name, token, environment, log, 0);
    if (f) f->may_return_early = early_return;
    return f;
}

FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateScheduledExecution)(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback *log,
    fmi3ClockUpdateCallback *clock, fmi3LockPreemptionCallback *lock, fmi3LockPreemptionCallback *unlock) {
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)clock;
    (void)lock;
    (void)unlock;
    if (log) log(environment, fmi3Error, "logStatusError", "this FMU has no scheduled execution");
    return NULL;
}

FMI3_EXPORT void FMI3_NAME(fmi3FreeInstance)(fmi3Instance instance) { fmu_free(instance); }

FMI3(fmi3EnterInitializationMode)(fmi3Instance instance, fmi3Boolean has_tolerance, fmi3Float64 tolerance, fmi3Float64 start,
    fmi3Boolean has_stop, fmi3Float64 stop) {
    return status_of(fmu_begin(instance, has_tolerance, tolerance, start, has_stop, stop));
}

FMI3(fmi3ExitInitializationMode)(fmi3Instance instance) { return status_of(fmu_begun(instance)); }

FMI3(fmi3EnterEventMode)(fmi3Instance instance) {
    ((fmu_instance *)instance)->s.mode = FMU_EVENT_MODE;
    return fmi3OK;
}

FMI3(fmi3Terminate)(fmi3Instance instance) {
    ((fmu_instance *)instance)->s.mode = FMU_TERMINATED;
    return fmi3OK;
}

FMI3(fmi3Reset)(fmi3Instance instance) {
    fmu_reset(instance);
    return fmi3OK;
}

FMI3(fmi3GetFloat64)(fmi3Instance instance, const fmi3ValueReference which[], size_t n, fmi3Float64 values[], size_t n_values) {
    if (n_values != n) return unsupported(instance, "values of arrays");
    for (size_t i = 0; i < n; i++)
        if (fmu_get(instance, which[i], values + i)) return fmi3Error;
    return fmi3OK;
}

FMI3(fmi3SetFloat64)(
    fmi3Instance instance, const fmi3ValueReference which[], size_t n, const fmi3Float64 values[], size_t n_values) {
    if (n_values != n) return unsupported(instance, "values of arrays");
    for (size_t i = 0; i < n; i++)
        if (fmu_set(instance, which[i], values[i])) return fmi3Error;
    return fmi3OK;
}

// All variables are of the type Float64; of others there are none.
#define FMI3_OTHER(type, value_type)                                                                                             \
    FMI3(fmi3Get##type)(                                                                                                         \
        fmi3Instance instance, const fmi3ValueReference which[], size_t n, value_type values[], size_t n_values) {               \
        (void)which;                                                                                                             \
        (void)values;                                                                                                            \
        (void)n_values;                                                                                                          \
        return n ? unsupported(instance, "a variable of the type " #type) : fmi3OK;                                              \
    }                                                                                                                            \
    FMI3(fmi3Set##type)(                                                                                                         \
        fmi3Instance instance, const fmi3ValueReference which[], size_t n, const value_type values[], size_t n_values) {         \
        (void)which;                                                                                                             \
        (void)values;                                                                                                            \
        (void)n_values;                                                                                                          \
        return n ? unsupported(instance, "a variable of the type " #type) : fmi3OK;                                              \
    }
FMI3_OTHER(Float32, fmi3Float32)
FMI3_OTHER(Int8, int8_t)
FMI3_OTHER(UInt8, uint8_t)
FMI3_OTHER(Int16, int16_t)
FMI3_OTHER(UInt16, uint16_t)
FMI3_OTHER(Int32, int32_t)
FMI3_OTHER(UInt32, uint32_t)
FMI3_OTHER(Int64, int64_t)
FMI3_OTHER(UInt64, uint64_t)
FMI3_OTHER(Boolean, fmi3Boolean)
FMI3_OTHER(String, fmi3String)

FMI3(fmi3GetBinary)(
    fmi3Instance instance, const fmi3ValueReference which[], size_t n, size_t sizes[], fmi3Binary values[], size_t n_values) {
    (void)which;
    (void)sizes;
    (void)values;
    (void)n_values;
    return n ? unsupported(instance, "a variable of the type Binary") : fmi3OK;
}

FMI3(fmi3SetBinary)(fmi3Instance instance, const fmi3ValueReference which[], size_t n, const size_t sizes[],
    const fmi3Binary values[], size_t n_values) {
    (void)which;
    (void)sizes;
    (void)values;
    (void)n_values;
    return n ? unsupported(instance, "a variable of the type Binary") : fmi3OK;
}

FMI3(fmi3GetClock)(fmi3Instance instance, const fmi3ValueReference which[], size_t n, fmi3Clock values[]) {
    (void)which;
    (void)values;
    return n ? unsupported(instance, "a clock") : fmi3OK;
}

FMI3(fmi3SetClock)(fmi3Instance instance, const fmi3ValueReference which[], size_t n, const fmi3Clock values[]) {
    (void)which;
    (void)values;
    return n ? unsupported(instance, "a clock") : fmi3OK;
}

FMI3(fmi3GetNumberOfVariableDependencies)(fmi3Instance instance, fmi3ValueReference which, size_t *n) {
    (void)which;
    (void)n;
    return unsupported(instance, "dependencies of single elements");
}

FMI3(fmi3GetVariableDependencies)(fmi3Instance instance, fmi3ValueReference dependent, size_t elements[],
    fmi3ValueReference independents[], size_t others[], fmi3DependencyKind kinds[], size_t n) {
    (void)dependent;
    (void)elements;
    (void)independents;
    (void)others;
    (void)kinds;
    (void)n;
    return unsupported(instance, "dependencies of single elements");
}

FMI3(fmi3GetFMUState)(fmi3Instance instance, fmi3FMUState *state) {
    if (!*state) *state = malloc(fmu_copy_size(instance));
    if (!*state) return unsupported(instance, "memory for a copy of the state");
    fmu_copy_out(instance, *state);
    return fmi3OK;
}

FMI3(fmi3SetFMUState)(fmi3Instance instance, fmi3FMUState state) { return status_of(fmu_copy_in(instance, state)); }

FMI3(fmi3FreeFMUState)(fmi3Instance instance, fmi3FMUState *state) {
    (void)instance;
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi3OK;
}

FMI3(fmi3SerializedFMUStateSize)(fmi3Instance instance, fmi3FMUState state, size_t *size) {
    (void)state;
    *size = fmu_serialized_size(instance);
    return fmi3OK;
}

FMI3(fmi3SerializeFMUState)(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    return status_of(fmu_serialize(instance, state, (char *)bytes, size));
}

FMI3(fmi3DeserializeFMUState)(fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    return status_of(fmu_deserialize(instance, (const char *)bytes, size, state));
}

FMI3(fmi3GetDirectionalDerivative)(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t n_unknowns,
    const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[],
    size_t n_sensitivity) {
    if (n_seed != n_knowns || n_sensitivity != n_unknowns) return unsupported(instance, "derivatives of arrays");
    return status_of(fmu_derivatives(instance, unknowns, n_unknowns, knowns, n_knowns, seed, 0, sensitivity));
}

FMI3(fmi3GetAdjointDerivative)(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t n_unknowns,
    const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[],
    size_t n_sensitivity) {
    if (n_seed != n_unknowns || n_sensitivity != n_knowns) return unsupported(instance, "derivatives of arrays");
    return status_of(fmu_derivatives(instance, unknowns, n_unknowns, knowns, n_knowns, seed, 1, sensitivity));
}

FMI3(fmi3EnterConfigurationMode)(fmi3Instance instance) { return unsupported(instance, "configuration mode"); }
FMI3(fmi3ExitConfigurationMode)(fmi3Instance instance) { return unsupported(instance, "configuration mode"); }

FMI3(fmi3GetIntervalDecimal)(fmi3Instance instance, const fmi3ValueReference which[], size_t n, fmi3Float64 intervals[],
    fmi3IntervalQualifier qualifiers[]) {
    (void)which;
    (void)n;
    (void)intervals;
    (void)qualifiers;
    return unsupported(instance, "a clock");
}

FMI3(fmi3GetIntervalFraction)(fmi3Instance instance, const fmi3ValueReference which[], size_t n, uint64_t counters[],
    uint64_t resolutions[], fmi3IntervalQualifier qualifiers[]) {
    (void)which;
    (void)n;
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    return unsupported(instance, "a clock");
}

FMI3(fmi3GetShiftDecimal)(fmi3Instance instance, const fmi3ValueReference which[], size_t n, fmi3Float64 shifts[]) {
    (void)which;
    (void)n;
    (void)shifts;
    return unsupported(instance, "a clock");
}

FMI3(fmi3GetShiftFraction)(
    fmi3Instance instance, const fmi3ValueReference which[], size_t n, uint64_t counters[], uint64_t resolutions[]) {
    (void)which;
    (void)n;
    (void)counters;
    (void)resolutions;
    return unsupported(instance, "a clock");
}

FMI3(fmi3SetIntervalDecimal)(fmi3Instance instance, const fmi3ValueReference which[], size_t n, const fmi3Float64 intervals[]) {
    (void)which;
    (void)n;
    (void)intervals;
    return unsupported(instance, "a clock");
}

FMI3(fmi3SetIntervalFraction)(
    fmi3Instance instance, const fmi3ValueReference which[], size_t n, const uint64_t counters[], const uint64_t resolutions[]) {
    (void)which;
    (void)n;
    (void)counters;
    (void)resolutions;
    return unsupported(instance, "a clock");
}

FMI3(fmi3SetShiftDecimal)(fmi3Instance instance, const fmi3ValueReference which[], size_t n, const fmi3Float64 shifts[]) {
    (void)which;
    (void)n;
    (void)shifts;
    return unsupported(instance, "a clock");
}

FMI3(fmi3SetShiftFraction)(
    fmi3Instance instance, const fmi3ValueReference which[], size_t n, const uint64_t counters[], const uint64_t resolutions[]) {
    (void)which;
    (void)n;
    (void)counters;
    (void)resolutions;
    return unsupported(instance, "a clock");
}

FMI3(fmi3EvaluateDiscreteStates)(fmi3Instance instance) {
    (void)instance;
    return fmi3OK;
}

FMI3(fmi3UpdateDiscreteStates)(fmi3Instance instance, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals_changed,
    fmi3Boolean *values_changed, fmi3Boolean *has_next, fmi3Float64 *next) {
    int changed = 0;
    const int code = fmu_discrete(instance, &changed);
    *again = *nominals_changed = *has_next = false;
    *next = 0.0;
    *terminate = code == FMU_STOPPED;
    *values_changed = changed != 0;
    return status_of(code);
}

FMI3(fmi3EnterContinuousTimeMode)(fmi3Instance instance) {
    ((fmu_instance *)instance)->s.mode = FMU_CONTINUOUS;
    return fmi3OK;
}

FMI3(fmi3CompletedIntegratorStep)(
    fmi3Instance instance, fmi3Boolean no_way_back, fmi3Boolean *event_mode, fmi3Boolean *terminate) {
    fmu_instance *const f = instance;
    (void)no_way_back;
    const int code = fmu_has_drifted(f, &f->s.drifted);
    *event_mode = f->s.drifted != 0;
    *terminate = false;
    return status_of(code);
}

FMI3(fmi3SetTime)(fmi3Instance instance, fmi3Float64 time) {
    fmu_instance *const f = instance;
    if (f->s.t != time) fmu_changed(f);
    f->s.t = time;
    return fmi3OK;
}

FMI3(fmi3SetContinuousStates)(fmi3Instance instance, const fmi3Float64 x[], size_t n) {
    fmu_instance *const f = instance;
    if (n != FMU_N_X) return unsupported(instance, "this number of states");
    memcpy(f->s.x, x, sizeof f->s.x);
    fmu_changed(f);
    return fmi3OK;
}

FMI3(fmi3GetContinuousStateDerivatives)(fmi3Instance instance, fmi3Float64 rates[], size_t n) {
    fmu_instance *const f = instance;
    if (n != FMU_N_X) return unsupported(instance, "this number of states");
    if (fmu_rates_now(f)) return fmi3Error;
    memcpy(rates, f->rates, sizeof f->rates);
    return fmi3OK;
}

FMI3(fmi3GetEventIndicators)(fmi3Instance instance, fmi3Float64 values[], size_t n) {
    if (n != FMU_N_EVENTS) return unsupported(instance, "this number of event indicators");
    return status_of(fmu_events_now(instance, values));
}

FMI3(fmi3GetContinuousStates)(fmi3Instance instance, fmi3Float64 x[], size_t n) {
    if (n != FMU_N_X) return unsupported(instance, "this number of states");
    memcpy(x, ((fmu_instance *)instance)->s.x, FMU_N_X * sizeof(double));
    return fmi3OK;
}

FMI3(fmi3GetNominalsOfContinuousStates)(fmi3Instance instance, fmi3Float64 nominals[], size_t n) {
    if (n != FMU_N_X) return unsupported(instance, "this number of states");
    for (size_t i = 0; i < n; i++) nominals[i] = 1.0;
    return fmi3OK;
}

FMI3(fmi3GetNumberOfEventIndicators)(fmi3Instance instance, size_t *n) {
    (void)instance;
    *n = FMU_N_EVENTS;
    return fmi3OK;
}

FMI3(fmi3GetNumberOfContinuousStates)(fmi3Instance instance, size_t *n) {
    (void)instance;
    *n = FMU_N_X;
    return fmi3OK;
}

FMI3(fmi3EnterStepMode)(fmi3Instance instance) {
    ((fmu_instance *)instance)->s.mode = FMU_STEPPING;
    return fmi3OK;
}

FMI3(fmi3GetOutputDerivatives)(fmi3Instance instance, const fmi3ValueReference which[], size_t n, const int32_t orders[],
    fmi3Float64 values[], size_t n_values) {
    (void)which;
    (void)n;
    (void)orders;
    (void)values;
    (void)n_values;
    return unsupported(instance, "derivatives of outputs by time");
}

FMI3(fmi3DoStep)(fmi3Instance instance, fmi3Float64 now, fmi3Float64 step, fmi3Boolean no_way_back, fmi3Boolean *event_mode,
    fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached) {
    (void)no_way_back;
    (void)now;
    const int code = fmu_step(instance, step, reached);
    *event_mode = false;
    *terminate = code == FMU_STOPPED;
    *early = *terminate && ((fmu_instance *)instance)->may_return_early;
    return status_of(code);
}

FMI3(fmi3ActivateModelPartition)(fmi3Instance instance, fmi3ValueReference clock, fmi3Float64 time) {
    (void)clock;
    (void)time;
    return unsupported(instance, "scheduled execution");
}
