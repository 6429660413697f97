"""Whether the kernels are compiled for this processor, and compiling them now."""

import json
import sys
from dataclasses import asdict, dataclass
from typing import Final

from common.errors import ConfigurationError
from feelahead.commands.doctor.finding import Finding, Verdict
from feelahead.lab.progress import progress

COMPILE: Final = "feelahead doctor --compile"


@dataclass(frozen=True)
class KernelFacts:
    """How many kernels there are, and how many of them are not compiled."""

    kernels: int
    missing: int
    folder: str
    """Where their machine code is kept."""
    writable: bool


def check_kernels(facts: KernelFacts | None) -> list[Finding]:
    """Whether a start compiles; `facts`: None where there is no Numba, which another check says."""
    if facts is None:
        return []
    if not facts.missing:
        return [Finding("kernels", Verdict.OK, f"{facts.kernels} compiled for this processor, in {facts.folder}")]
    said = f"{facts.missing} of {facts.kernels} are not compiled for this processor"
    if not facts.writable:
        remedy = f"let this user write to {facts.folder}, or set NUMBA_CACHE_DIR to another folder; then: {COMPILE}"
        said = f"{said}, and {facts.folder} keeps none: each start compiles, about a minute"
        return [Finding("kernels", Verdict.NOTE, said, remedy)]
    return [Finding("kernels", Verdict.NOTE, f"{said}: the first start does, about half a minute", COMPILE)]


def compile_kernels(*, as_json: bool) -> int:
    """Compile those that are not, and say what there is then; 1 where they are not kept for the next start."""
    try:
        from robot_side.compiled.machine_code import can_keep, machine_code_folder  # noqa: PLC0415
        from robot_side.compiled.warm_up import import_kernels, warm_up  # noqa: PLC0415

        kernels = import_kernels()
    except ImportError as error:
        raise ConfigurationError(f"--compile: {error}; valid: with pip install 'feelahead[robot]'") from error
    missing = {kernel.name for kernel in kernels if not kernel.is_kept}
    with progress("compiling", max(len(missing), 1)) as advance:
        took_s = warm_up(kernels=kernels, done=lambda name: advance(1.0 if name in missing else 0.0))
    left = sum(not kernel.is_kept for kernel in kernels)
    facts = KernelFacts(len(kernels), left, str(machine_code_folder()), can_keep())
    if as_json:
        said = json.dumps({"compiled": len(missing), "took_s": took_s, **asdict(facts)}, indent=2)
    elif left:
        said = f"{left} of {len(kernels)} kernels were compiled, but not kept: no room, or no right, in {facts.folder}"
    else:
        said = f"{len(missing)} kernels compiled in {took_s:.0f} s, {len(kernels)} in all, kept in {facts.folder}"
    sys.stdout.write(said + "\n")
    return 1 if left else 0
