"""Checks of this machine: installed packages, compiled kernels, rendering of pictures, real-time priority."""

import importlib
import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Final

from rich.console import Console
from rich.progress import Progress

from common.errors import ConfigurationError
from common.extras import installing
from feelahead.commands.doctor.finding import Finding, Verdict
from robot_side.drivers.mujoco.drawing.off_screen import BACKENDS, REMEDY

if TYPE_CHECKING:
    from robot_side.compiled.kernel import Compiled

EXTRAS: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = {
    "robot": ("the simulated arm: the demo and feelahead-robot", ("mujoco", "numba", "simplejpeg")),
    "operator": (
        "a real controller and the browser console",
        ("hidraw" if sys.platform == "linux" else "hid", "viser", "trimesh"),
    ),
    "video": ("pictures in H.264, a tenth of JPEG's bytes or less", ("av",)),
    "record": ("recording runs", ("foxglove", "mcap")),
    "experiments": ("plots, Parquet, LeRobot, sweeps over many runs", ("matplotlib", "pyarrow", "distributed")),
    "recorded": ("depth pictures of a ROS 2 recording", ("rosbags",)),
    "tags": ("objects found by printed tags", ("cv2",)),
    "study": ("a study's report and plan", ("statsmodels", "pandas", "pyarrow", "matplotlib")),
}
"""Purpose and imported modules of each extra of the package, by its name"""
COMPILE: Final = "feelahead doctor --compile"
_LIMIT_S: Final = 60.0
_RENDER: Final = """
import json, sys
from robot_side.drivers.mujoco.drawing.off_screen import trouble_with
print(json.dumps(trouble_with(sys.argv[1])))
"""
_REALTIME: Final = "import json; from common.realtime.priority import make_realtime; print(json.dumps(make_realtime()))"


@dataclass(frozen=True)
class KernelFacts:
    """Number of kernels, how many of them have no stored machine code, and where it is stored."""

    kernels: int
    missing: int
    folder: str
    """Folder of the kernels' machine code"""
    writable: bool


def check_extra(extra: str, failures: Mapping[str, str]) -> Finding:
    """Check that every module of an extra can be imported.

    failures: Python's error for each module that cannot be imported.
    """
    (purpose, modules), name = EXTRAS[extra], f"extra {extra}"
    if not failures:
        return Finding(name, Verdict.OK, f"{', '.join(modules)}: {purpose}")
    absent = [module for module, reason in failures.items() if "No module named" in reason]
    broken = [f"{module} ({reason})" for module, reason in failures.items() if module not in absent]
    reasons = {"not installed": absent, "cannot be imported": broken}
    said = "; ".join(f"{how}: {', '.join(found)}" for how, found in reasons.items() if found)
    remedy = installing(extra, again=bool(broken))
    return Finding(name, Verdict.NOTE, f"{said} (for {purpose})", remedy)


def check_kernels(facts: KernelFacts | None) -> list[Finding]:
    """Check whether the next start has to compile kernels.

    facts: None if Numba is missing, which another check reports.
    """
    if facts is None:
        return []
    if not facts.missing:
        return [Finding("kernels", Verdict.OK, f"{facts.kernels} compiled for this processor, in {facts.folder}")]
    said, remedy = "the first start compiles them, in about half a minute", COMPILE
    if not facts.writable:
        said = f"{facts.folder} cannot keep them: each start compiles for about half a minute"
        remedy = f"let this user write to {facts.folder}, or set NUMBA_CACHE_DIR to another folder; then: {COMPILE}"
    missing = f"{facts.missing} of {facts.kernels} are not compiled for this processor"
    return [Finding("kernels", Verdict.NOTE, f"{missing}: {said}", remedy)]


def check_rendering(troubles: Mapping[str, str | None]) -> Finding:
    """Check that the cameras' pictures can be rendered.

    troubles: for each off-screen backend, why it fails; None if it works.
    """
    working = [name for name, trouble in troubles.items() if trouble is None]
    if working:
        return Finding("cameras", Verdict.OK, f"rendered without a screen by {working[0].upper() or 'OpenGL'}")
    said = "; ".join(trouble for trouble in troubles.values() if trouble is not None)
    remedy = REMEDY if "egl" in troubles else None
    return Finding(
        "cameras", Verdict.NOTE, f"no pictures can be made; the arm can be driven without them: {said}", remedy
    )


def check_realtime(notes: Sequence[str]) -> list[Finding]:
    """Check whether the system would grant `--realtime`; `notes` has a line for each refused part."""
    if sys.platform != "linux":
        return [Finding("--realtime", Verdict.NOTE, "only Linux has it; the sides run without it")]
    findings = []
    for note in notes:
        said, _, how = note.removeprefix("--realtime: ").partition("; to permit it: ")
        findings.append(Finding("--realtime", Verdict.NOTE, f"{said}; the sides run without it", how or None))
    return findings or [Finding("--realtime", Verdict.OK, "permitted")]


def failed_imports(extra: str) -> dict[str, str]:
    """Return the reason for each module of an extra that cannot be imported."""
    failures = {}
    for module in EXTRAS[extra][1]:
        try:
            importlib.import_module(module)
        # An import may raise any error.
        except Exception as error:
            failures[module] = (str(error).splitlines() or [type(error).__name__])[0]
    return failures


def kernel_facts() -> KernelFacts | None:
    """Count the kernels and the missing ones; None if Numba or another import is missing."""
    try:
        from robot_side.compiled.warm_up import import_kernels  # noqa: PLC0415
    except ImportError:
        return None
    return _facts(import_kernels())


def _facts(kernels: Sequence["Compiled"]) -> KernelFacts:
    from robot_side.compiled.machine_code import can_keep, machine_code_folder  # noqa: PLC0415

    missing = sum(not kernel.is_kept for kernel in kernels)
    return KernelFacts(len(kernels), missing, str(machine_code_folder()), can_keep())


def rendering_troubles() -> dict[str, str | None]:
    """Try each off-screen backend in a separate process; return why it fails, or None if it works."""
    outputs = {backend: _output_of(_RENDER, backend) for backend in BACKENDS}
    ended = "a trial picture crashes, or takes too long"
    return {backend: ended if said is None else json.loads(said) for backend, said in outputs.items()}


def realtime_notes() -> list[str]:
    """Try `--realtime` in a separate process; return a line for each refused part."""
    notes: list[str] = json.loads((sys.platform == "linux" and _output_of(_REALTIME)) or "[]")
    return notes


def _output_of(program: str, *arguments: str) -> str | None:
    """Run `program` in a separate Python process; return the last line that it prints, None if it fails."""
    command = [sys.executable, "-P", "-c", program, *arguments]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, check=True, timeout=_LIMIT_S, stdin=subprocess.DEVNULL
        )
    except (subprocess.SubprocessError, OSError):
        return None
    return done.stdout.strip().splitlines()[-1]


def compile_kernels(*, as_json: bool) -> int:
    """Compile the missing kernels and print the result; return 1 if their machine code could not be stored, else 0."""
    try:
        from robot_side.compiled.warm_up import import_kernels, warm_up  # noqa: PLC0415

        kernels = import_kernels()
    except ImportError as error:
        raise ConfigurationError(f"--compile: {error}; to install it: {installing('robot')}") from error
    missing = {kernel.name for kernel in kernels if not kernel.is_kept}
    console = Console(stderr=True)

    def announce(ready: int, of: int) -> None:
        # A bar shows nothing in a file or a pipe.
        if not console.is_terminal:
            console.print(f"compiling: {ready} of {of} kernels are ready")

    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("compiling", total=max(len(missing), 1))
        took_s = warm_up(announce, kernels, lambda name: progress.advance(task, name in missing))
    facts = _facts(kernels)
    left, folder = facts.missing, facts.folder
    if as_json:
        said = json.dumps({"compiled": len(missing), "took_s": took_s, **asdict(facts)}, indent=2)
    elif left:
        said = f"{left} of {len(kernels)} kernels were compiled, but not kept: no room, or no right, in {folder}"
    else:
        said = f"{len(missing)} kernels compiled in {took_s:.0f} s, {len(kernels)} in all, kept in {folder}"
    sys.stdout.write(said + "\n")
    return 1 if left else 0
