// The functions of the CUDA driver that symdyn calls, on the processor: memory is this process's, streams do at once what they
// are given, and a module is the library that the environment variable FAKE_KERNELS names. SIZE: bytes of a kernel's argument.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    char bytes[SIZE];
} argument;

enum { OK = 0, INVALID = 1, OUT_OF_MEMORY = 2, NOT_FOUND = 500 };

static long long n_blocks, n_modules, n_streams, n_launches;

int cuGetProcAddress_v2(const char *name, void **found, int version, unsigned long long flags, int *status) {
    (void)version, (void)flags;
    char other[100];
    void *own = dlopen("libcuda.so.1", RTLD_NOW | RTLD_NOLOAD);
    *found = dlsym(own, name);
    for (int k = 3; !*found && k > 1; k--) {
        snprintf(other, sizeof other, "%s_v%d", name, k);
        *found = dlsym(own, other);
    }
    if (status) *status = *found ? 0 : 1;
    return *found ? OK : NOT_FOUND;
}

int cuInit(unsigned flags) { return flags ? INVALID : OK; }
int cuDriverGetVersion(int *version) { return *version = 13000, OK; }
int cuDeviceGetCount(int *count) { return *count = 1, OK; }
int cuDeviceGet(int *device, int number) { return *device = number, number ? INVALID : OK; }
int cuDevicePrimaryCtxRetain(void **context, int device) { return *context = &n_blocks, device ? INVALID : OK; }
int cuCtxSetCurrent(void *context) { return context == &n_blocks ? OK : INVALID; }
int cuDeviceGetName(char *name, int length, int device) { return snprintf(name, length, "Fake %d", device), OK; }
int cuDeviceGetAttribute(int *value, int which, int device) {
    // Capability 9.0, two multiprocessors of 2048 threads.
    *value = which == 75 ? 9 : which == 76 ? 0 : which == 16 ? 2 : which == 39 ? 2048 : -1;
    return device || *value < 0 ? INVALID : OK;
}
int cuMemGetInfo_v2(size_t *left, size_t *total) { return *left = *total = (size_t)1 << 30, OK; }
int cuMemAlloc_v2(unsigned long long *address, size_t size) {
    *address = (unsigned long long)malloc(size);
    n_blocks++;
    return size && *address ? OK : OUT_OF_MEMORY;
}
int cuMemFree_v2(unsigned long long address) { return n_blocks--, free((void *)address), OK; }
int cuPointerGetAttribute(void *value, int which, unsigned long long address) {
    return *(int *)value = 0, address && which == 9 ? OK : INVALID;
}
int cuStreamCreate(void **stream, unsigned flags) { return n_streams++, *stream = malloc(1), flags == 1 ? OK : INVALID; }
int cuStreamDestroy_v2(void *stream) { return n_streams--, free(stream), OK; }
int cuStreamSynchronize(void *stream) { return stream ? OK : INVALID; }
int cuMemcpyHtoDAsync_v2(unsigned long long to, const void *from, size_t size, void *stream) {
    return memcpy((void *)to, from, size), stream ? OK : INVALID;
}
int cuMemcpyDtoHAsync_v2(void *to, unsigned long long from, size_t size, void *stream) {
    return memcpy(to, (const void *)from, size), stream ? OK : INVALID;
}
int cuModuleLoadData(void **module, const void *image) {
    static const char elf[4] = {0x7f, 'E', 'L', 'F'};
    if (memcmp(image, elf, sizeof elf)) return INVALID;  // machine code is an ELF file
    *module = dlopen(getenv("FAKE_KERNELS"), RTLD_NOW);
    return n_modules++, *module ? OK : NOT_FOUND;
}
int cuModuleUnload(void *module) { return n_modules--, dlclose(module) ? INVALID : OK; }
int cuModuleGetFunction(void **function, void *module, const char *name) {
    return *function = dlsym(module, name), *function ? OK : NOT_FOUND;
}
int cuFuncGetAttribute(int *value, int which, void *function) {
    return *value = which == 3 ? 3088 : -1, function && which == 3 ? OK : INVALID;  // bytes of a thread's stack
}
int cuOccupancyMaxActiveBlocksPerMultiprocessor(int *blocks, void *function, int threads, size_t shared) {
    return *blocks = 2048 / threads, function && !shared ? OK : INVALID;
}
int cuLaunchKernel(void *function, unsigned x, unsigned y, unsigned z, unsigned block_x, unsigned block_y, unsigned block_z,
    unsigned shared, void *stream, void **parameters, void **extra) {
    if (!x || y != 1 || z != 1 || !block_x || block_y != 1 || block_z != 1 || shared || !stream || extra) return INVALID;
    ((void (*)(argument))function)(*(const argument *)parameters[0]);
    return n_launches++, OK;
}

// Objects left: blocks, modules, streams; number of kernels that ran.
void fake_counts(long long *counts) {
    counts[0] = n_blocks, counts[1] = n_modules, counts[2] = n_streams, counts[3] = n_launches;
}
