// Words of CUDA C in kernels, and their replacements in C.
#pragma once

#if defined(__CUDACC__)
#define SYMDYN_KERNEL extern "C" __global__
#else
#define SYMDYN_KERNEL SYMDYN_EXPORT
#endif
