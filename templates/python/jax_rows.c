// A function of a compiled library as a function that XLA calls on a CPU, for any number of states; c_api.h of XLA stands before.
// Arguments t, x, ud, inputs, p with axes for states in front, of which those of length 1 hold for all states; attributes: the
// addresses of the function for rows and of the prologue, the number of constants, and the axes of a result.
#include <math.h>
#include <stdlib.h>

typedef struct {
    long n;
    const double *t, *x, *ud, *inputs, *p, *c;
    double *out;
    long t_stride, x_stride, ud_stride, inputs_stride;
    long failed;
} symdyn_frame;

typedef struct {
    const XLA_FFI_Buffer *buffer;
    int64_t axes, n;
    double *row;
} symdyn_argument;

static int64_t symdyn_attribute(const XLA_FFI_Attrs *attributes, const char *name) {
    for (int64_t i = 0; i < attributes->size; i++) {
        const XLA_FFI_ByteSpan *span = attributes->names[i];
        size_t k = 0;
        while (k < span->len && name[k] == span->ptr[k]) k++;
        if (k == span->len && !name[k]) return *(int64_t *)((XLA_FFI_Scalar *)attributes->attrs[i])->value;
    }
    return 0;
}

// The row of an argument for a state, which is counted along the axes of the result.
static int64_t symdyn_row_of(const symdyn_argument *argument, const XLA_FFI_Buffer *out, int64_t axes, int64_t state) {
    int64_t row = 0, step = 1;
    for (int64_t k = axes - 1; k >= 0; k--) {
        const int64_t wide = argument->buffer->dims[k], index = state % out->dims[k];
        state /= out->dims[k];
        if (wide > 1) row += index * step;
        step *= wide;
    }
    return row;
}

static void symdyn_read(const symdyn_argument *argument, int64_t row) {
    const int64_t first = row * argument->n;
    for (int64_t k = 0; k < argument->n; k++) {
        argument->row[k] = argument->buffer->dtype == XLA_FFI_DataType_F32 ? ((const float *)argument->buffer->data)[first + k]
                                                                           : ((const double *)argument->buffer->data)[first + k];
    }
}

#ifdef _WIN32
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
XLA_FFI_Error *symdyn_xla_rows(XLA_FFI_CallFrame *call) {
    for (XLA_FFI_Extension_Base *e = call->extension_start; e; e = e->next) {
        if (e->type == XLA_FFI_Extension_Metadata) {
            XLA_FFI_Metadata *metadata = ((XLA_FFI_Metadata_Extension *)e)->metadata;
            metadata->api_version.major_version = XLA_FFI_API_MAJOR;
            metadata->api_version.minor_version = XLA_FFI_API_MINOR;
            return NULL;
        }
    }
    if (call->stage != XLA_FFI_ExecutionStage_EXECUTE) return NULL;
    int (*rows)(symdyn_frame *) = (int (*)(symdyn_frame *))(intptr_t)symdyn_attribute(&call->attrs, "rows");
    int (*prologue)(const double *, double *) =
        (int (*)(const double *, double *))(intptr_t)symdyn_attribute(&call->attrs, "prologue");
    const int64_t n_c = symdyn_attribute(&call->attrs, "n_c"), inner = symdyn_attribute(&call->attrs, "inner");
    const XLA_FFI_Buffer *out = call->rets.rets[0];
    const int64_t axes = out->rank - inner;
    int64_t states = 1, size = 1, needed = n_c + 8;
    for (int64_t k = 0; k < out->rank; k++) *(k < axes ? &states : &size) *= out->dims[k];
    symdyn_argument arguments[5];
    for (int i = 0; i < 5; i++) {
        const XLA_FFI_Buffer *buffer = call->args.args[i];
        arguments[i] = (symdyn_argument){buffer, axes, i ? buffer->dims[axes] : 1, NULL};
        needed += arguments[i].n;
    }
    double *memory = malloc((size_t)(needed + size) * sizeof(double));
    if (!memory) {
        XLA_FFI_Error_Create_Args error = {
            XLA_FFI_Error_Create_Args_STRUCT_SIZE, NULL, "there is no memory left", XLA_FFI_Error_Code_RESOURCE_EXHAUSTED};
        return call->api->XLA_FFI_Error_Create(&error);
    }
    double *next = memory, *result = memory + needed;
    for (int i = 0; i < 5; i++) {
        arguments[i].row = next;
        next += arguments[i].n;
    }
    double *c = next;
    int stopped = 0;
    int64_t latest = -1;
    for (int64_t state = 0; state < states; state++) {
        for (int i = 0; i < 4; i++) symdyn_read(&arguments[i], symdyn_row_of(&arguments[i], out, axes, state));
        const int64_t row = symdyn_row_of(&arguments[4], out, axes, state);
        if (row != latest) {
            symdyn_read(&arguments[4], row);
            stopped = prologue(arguments[4].row, c);
            latest = row;
        }
        symdyn_frame frame = {1, arguments[0].row, arguments[1].row, arguments[2].row, arguments[3].row, arguments[4].row, c,
            result, 1, 1, 1, 1, 0};
        const int failed = stopped || rows(&frame);
        for (int64_t k = 0; k < size; k++) {
            const double value = failed ? NAN : result[k];
            if (out->dtype == XLA_FFI_DataType_F32)
                ((float *)out->data)[state * size + k] = (float)value;
            else
                ((double *)out->data)[state * size + k] = value;
        }
    }
    free(memory);
    return NULL;
}
