"""Many motions on a GPU: the C of a mechanism as a CUDA kernel, the device that runs it, chunks of motions."""
