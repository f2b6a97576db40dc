"""Functions of a mechanism for CasADi, JAX and PyTorch: statements of the tape on the vocabularies of these libraries."""
