"""What LLVM takes this machine's processor for, and how to prefer vectors of another width than it would choose."""

from llvmlite import binding

_PREFERENCES = {256: "+prefer-256-bit", 512: "-prefer-256-bit"}


def processor_name() -> str:
    """LLVM's name for it, which decides what is fast there: `znver5`, `cascadelake`."""
    return str(binding.get_host_cpu_name())


def has_wide_vectors() -> bool:
    """Whether it has vectors of 512 bits."""
    return bool(binding.get_host_cpu_features().get("avx512f", False))


def vector_environment(bits: int) -> dict[str, str]:
    """The environment variables of a process whose kernels prefer vectors of 256 or 512 bits."""
    features = f"{binding.get_host_cpu_features().flatten()},{_PREFERENCES[bits]}"
    return {"NUMBA_CPU_NAME": processor_name(), "NUMBA_CPU_FEATURES": features}
