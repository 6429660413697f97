"""What compiling with Numba takes: decorators, a safe cache, vectors in registers."""
