// What kernels have of CUDA C, and in C in its place.
#pragma once

#if defined(__CUDACC__)
#define SYMDYN_KERNEL extern "C" __global__
#else
#define SYMDYN_KERNEL SYMDYN_EXPORT
#endif
