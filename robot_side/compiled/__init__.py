"""Compilation with Numba: decorators, a safe cache, columns, arrays on the stack, vectors in registers."""
