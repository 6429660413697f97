"""Tools for compilation with Numba: decorators, a safe cache, bundles of arrays, arrays on the stack, vectors."""
