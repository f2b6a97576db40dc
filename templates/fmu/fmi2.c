// The functions of FMI 2.0 for an instance of the mechanism. Types as in the standard: Modelica Association, Functional Mock-up
// Interface for Model Exchange and Co-Simulation, version 2.0.4, sections 2.1, 3.2 and 4.2.
#include "instance.h"

typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef char fmi2Byte;
typedef const char *fmi2String;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void fmi2CallbackLogger(
    fmi2ComponentEnvironment, fmi2String name, fmi2Status, fmi2String category, fmi2String message, ...);
typedef struct {
    fmi2CallbackLogger *logger;
    void *(*allocateMemory)(size_t n, size_t size);
    void (*freeMemory)(void *memory);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;
typedef struct {
    fmi2Boolean newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged, valuesOfContinuousStatesChanged,
        nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;

#if defined(_WIN32)
#define FMI2_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI2_EXPORT __attribute__((visibility("default")))
#else
#define FMI2_EXPORT
#endif
// Sources that are linked with others have names with a prefix, as the standard asks.
#ifdef FMI2_FUNCTION_PREFIX
#define FMI2_JOINED(prefix, name) prefix##name
#define FMI2_WITH(prefix, name) FMI2_JOINED(prefix, name)
#define FMI2_NAME(name) FMI2_WITH(FMI2_FUNCTION_PREFIX, name)
#else
#define FMI2_NAME(name) name
#endif
#define FMI2(name) FMI2_EXPORT fmi2Status FMI2_NAME(name)

static void fmu_log(fmu_instance *f, int failed, const char *message) {
    if (f->log)
        ((fmi2CallbackLogger *)f->log)(f->environment, f->name, failed ? fmi2Error : fmi2Warning,
            failed ? "logStatusError" : "logStatusWarning", "%s", message);
}

static fmi2Status status_of(int code) { return code == FMU_FAILED ? fmi2Error : fmi2OK; }

static fmi2Status unsupported(fmi2Component component, const char *what) {
    fmu_fail(component, what, "this FMU does not have it");
    return fmi2Error;
}

FMI2_EXPORT const char *FMI2_NAME(fmi2GetTypesPlatform)(void) { return "default"; }
FMI2_EXPORT const char *FMI2_NAME(fmi2GetVersion)(void) { return "2.0"; }

FMI2(fmi2SetDebugLogging)(fmi2Component component, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    (void)component;
    (void)on;
    (void)n;
    (void)categories;
    return fmi2OK;  // what is logged are errors and warnings
}

FMI2_EXPORT fmi2Component FMI2_NAME(fmi2Instantiate)(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
    const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)resources;
    (void)visible;
    (void)logging;
    fmu_instance *const f = (type == fmi2ModelExchange) == FMU_MODEL_EXCHANGE ? fmu_new(name, token) : NULL;
    if (!f) {
        if (functions && functions->logger)
            functions->logger(functions->componentEnvironment, name, fmi2Error, "logStatusError", "%s",
                "no instance: the GUID or the kind is that of another FMU");
        return NULL;
    }
    f->environment = functions ? functions->componentEnvironment : NULL;
    f->log = functions ? (void (*)(void))functions->logger : NULL;
    return f;
}

FMI2_EXPORT void FMI2_NAME(fmi2FreeInstance)(fmi2Component component) { fmu_free(component); }

FMI2(fmi2SetupExperiment)(
    fmi2Component component, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start, fmi2Boolean has_stop, fmi2Real stop) {
    const int code = fmu_begin(component, has_tolerance, tolerance, start, has_stop, stop);
    ((fmu_instance *)component)->s.mode = FMU_INSTANTIATED;
    return status_of(code);
}

FMI2(fmi2EnterInitializationMode)(fmi2Component component) {
    ((fmu_instance *)component)->s.mode = FMU_INITIALIZATION;
    return fmi2OK;
}

FMI2(fmi2ExitInitializationMode)(fmi2Component component) { return status_of(fmu_begun(component)); }

FMI2(fmi2Terminate)(fmi2Component component) {
    ((fmu_instance *)component)->s.mode = FMU_TERMINATED;
    return fmi2OK;
}

FMI2(fmi2Reset)(fmi2Component component) {
    fmu_reset(component);
    return fmi2OK;
}

FMI2(fmi2GetReal)(fmi2Component component, const fmi2ValueReference which[], size_t n, fmi2Real values[]) {
    for (size_t i = 0; i < n; i++)
        if (fmu_get(component, which[i], values + i)) return fmi2Error;
    return fmi2OK;
}

FMI2(fmi2SetReal)(fmi2Component component, const fmi2ValueReference which[], size_t n, const fmi2Real values[]) {
    for (size_t i = 0; i < n; i++)
        if (fmu_set(component, which[i], values[i])) return fmi2Error;
    return fmi2OK;
}

// All variables are of the type Real; of others there are none.
#define FMI2_OTHER(type)                                                                                                         \
    FMI2(fmi2Get##type)(fmi2Component component, const fmi2ValueReference which[], size_t n, fmi2##type values[]) {              \
        (void)which;                                                                                                             \
        (void)values;                                                                                                            \
        return n ? unsupported(component, "a variable of the type " #type) : fmi2OK;                                             \
    }                                                                                                                            \
    FMI2(fmi2Set##type)(fmi2Component component, const fmi2ValueReference which[], size_t n, const fmi2##type values[]) {        \
        (void)which;                                                                                                             \
        (void)values;                                                                                                            \
        return n ? unsupported(component, "a variable of the type " #type) : fmi2OK;                                             \
    }
FMI2_OTHER(Integer)
FMI2_OTHER(Boolean)
FMI2_OTHER(String)

FMI2(fmi2GetFMUstate)(fmi2Component component, fmi2FMUstate *state) {
    if (!*state) *state = malloc(fmu_copy_size(component));
    if (!*state) return unsupported(component, "memory for a copy of the state");
    fmu_copy_out(component, *state);
    return fmi2OK;
}

FMI2(fmi2SetFMUstate)(fmi2Component component, fmi2FMUstate state) { return status_of(fmu_copy_in(component, state)); }

FMI2(fmi2FreeFMUstate)(fmi2Component component, fmi2FMUstate *state) {
    (void)component;
    if (state) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

FMI2(fmi2SerializedFMUstateSize)(fmi2Component component, fmi2FMUstate state, size_t *size) {
    (void)state;
    *size = fmu_serialized_size(component);
    return fmi2OK;
}

FMI2(fmi2SerializeFMUstate)(fmi2Component component, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    return status_of(fmu_serialize(component, state, bytes, size));
}

FMI2(fmi2DeSerializeFMUstate)(fmi2Component component, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    return status_of(fmu_deserialize(component, bytes, size, state));
}

FMI2(fmi2GetDirectionalDerivative)(fmi2Component component, const fmi2ValueReference unknowns[], size_t n_unknowns,
    const fmi2ValueReference knowns[], size_t n_knowns, const fmi2Real seed[], fmi2Real sensitivity[]) {
    return status_of(fmu_derivatives(component, unknowns, n_unknowns, knowns, n_knowns, seed, 0, sensitivity));
}

FMI2(fmi2EnterEventMode)(fmi2Component component) {
    ((fmu_instance *)component)->s.mode = FMU_EVENT_MODE;
    return fmi2OK;
}

FMI2(fmi2NewDiscreteStates)(fmi2Component component, fmi2EventInfo *info) {
    int changed = 0;
    const int code = fmu_discrete(component, &changed);
    *info = (fmi2EventInfo){.terminateSimulation = code == FMU_STOPPED, .valuesOfContinuousStatesChanged = changed};
    return status_of(code);
}

FMI2(fmi2EnterContinuousTimeMode)(fmi2Component component) {
    ((fmu_instance *)component)->s.mode = FMU_CONTINUOUS;
    return fmi2OK;
}

FMI2(fmi2CompletedIntegratorStep)(
    fmi2Component component, fmi2Boolean no_way_back, fmi2Boolean *event_mode, fmi2Boolean *terminate) {
    fmu_instance *const f = component;
    (void)no_way_back;
    const int code = fmu_has_drifted(f, &f->s.drifted);
    *event_mode = f->s.drifted;
    *terminate = 0;
    return status_of(code);
}

FMI2(fmi2SetTime)(fmi2Component component, fmi2Real time) {
    fmu_instance *const f = component;
    if (f->s.t != time) fmu_changed(f);
    f->s.t = time;
    return fmi2OK;
}

FMI2(fmi2SetContinuousStates)(fmi2Component component, const fmi2Real x[], size_t n) {
    fmu_instance *const f = component;
    if (n != FMU_N_X) return unsupported(component, "this number of states");
    memcpy(f->s.x, x, sizeof f->s.x);
    fmu_changed(f);
    return fmi2OK;
}

FMI2(fmi2GetDerivatives)(fmi2Component component, fmi2Real rates[], size_t n) {
    fmu_instance *const f = component;
    if (n != FMU_N_X) return unsupported(component, "this number of states");
    if (fmu_rates_now(f)) return fmi2Error;
    memcpy(rates, f->rates, sizeof f->rates);
    return fmi2OK;
}

FMI2(fmi2GetEventIndicators)(fmi2Component component, fmi2Real values[], size_t n) {
    if (n != FMU_N_EVENTS) return unsupported(component, "this number of event indicators");
    return status_of(fmu_events_now(component, values));
}

FMI2(fmi2GetContinuousStates)(fmi2Component component, fmi2Real x[], size_t n) {
    if (n != FMU_N_X) return unsupported(component, "this number of states");
    memcpy(x, ((fmu_instance *)component)->s.x, FMU_N_X * sizeof(double));
    return fmi2OK;
}

FMI2(fmi2GetNominalsOfContinuousStates)(fmi2Component component, fmi2Real nominals[], size_t n) {
    if (n != FMU_N_X) return unsupported(component, "this number of states");
    for (size_t i = 0; i < n; i++) nominals[i] = 1.0;
    return fmi2OK;
}

FMI2(fmi2SetRealInputDerivatives)(
    fmi2Component component, const fmi2ValueReference which[], size_t n, const fmi2Integer orders[], const fmi2Real values[]) {
    (void)which;
    (void)n;
    (void)orders;
    (void)values;
    return unsupported(component, "derivatives of inputs by time");
}

FMI2(fmi2GetRealOutputDerivatives)(
    fmi2Component component, const fmi2ValueReference which[], size_t n, const fmi2Integer orders[], fmi2Real values[]) {
    (void)which;
    (void)n;
    (void)orders;
    (void)values;
    return unsupported(component, "derivatives of outputs by time");
}

FMI2(fmi2DoStep)(fmi2Component component, fmi2Real now, fmi2Real step, fmi2Boolean no_way_back) {
    double reached;
    (void)no_way_back;
    (void)now;
    const int code = fmu_step(component, step, &reached);
    return code == FMU_STOPPED ? fmi2Discard : status_of(code);
}

FMI2(fmi2CancelStep)(fmi2Component component) { return unsupported(component, "steps that run in the background"); }

FMI2(fmi2GetStatus)(fmi2Component component, const fmi2StatusKind kind, fmi2Status *value) {
    (void)component;
    (void)kind;
    *value = fmi2OK;
    return fmi2OK;
}

FMI2(fmi2GetRealStatus)(fmi2Component component, const fmi2StatusKind kind, fmi2Real *value) {
    if (kind != fmi2LastSuccessfulTime) return unsupported(component, "a status of this kind");
    *value = ((fmu_instance *)component)->s.t;
    return fmi2OK;
}

FMI2(fmi2GetIntegerStatus)(fmi2Component component, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind;
    (void)value;
    return unsupported(component, "a status of this kind");
}

FMI2(fmi2GetBooleanStatus)(fmi2Component component, const fmi2StatusKind kind, fmi2Boolean *value) {
    if (kind != fmi2Terminated) return unsupported(component, "a status of this kind");
    *value = ((fmu_instance *)component)->s.stopped;
    return fmi2OK;
}

FMI2(fmi2GetStringStatus)(fmi2Component component, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind;
    (void)value;
    return unsupported(component, "a status of this kind");
}
