"""Priority of a side's process over other programs on the machine, as far as the system permits it."""

import atexit
import contextlib
import ctypes
import os
import resource
import sys
from pathlib import Path

_NICENESS = -10
"""Niceness of a side: a higher priority than ordinary programs, a lower one than system services."""
_REALTIME_PRIORITY = 20
"""Real-time priority: above every ordinary program, below the kernel's interrupt threads (50)."""
_PR_SET_TIMERSLACK = 29
_CAP_IPC_LOCK = 14
"""Number of the capability in linux/capability.h"""
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4
"""Flags of mlockall in asm-generic/mman.h"""
_SESSION = Path("/proc/self/autogroup")
"""Niceness of the whole login session, where Linux groups processes by session (autogroup)"""


def raise_priority() -> bool:
    """Request exact sleeps and a higher priority; return whether the priority was granted, which needs CAP_SYS_NICE."""
    _libc().prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)  # by default sleeps may end 50 us late, to save power
    for thread in _threads():
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, thread, _NICENESS)
    _raise_session()
    return os.getpriority(os.PRIO_PROCESS, 0) <= _NICENESS


def lower_priority(niceness: int) -> None:
    """Give up the real-time scheduling and the priority that a companion inherits from a side; take this niceness.

    A higher niceness stays. A companion has a session of its own, to which the niceness applies, too.
    """
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    for thread in _threads():
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, thread, max(niceness, os.getpriority(os.PRIO_PROCESS, thread)))
    with contextlib.suppress(OSError):
        _SESSION.write_text(str(niceness), encoding="ascii")


def make_realtime() -> list[str]:
    """Set first-in-first-out scheduling for the present threads, and lock memory.

    Return a note, of one line, for each of the two that was refused; it ends with the command that permits it.
    """
    notes = []
    try:
        schedule_realtime()
    except PermissionError:
        notes.append(f"--realtime: real-time scheduling is not permitted; to permit it: {_permit('cap_sys_nice')}")
    if not _lock_memory():
        notes.append(f"--realtime: locking memory is not permitted; to permit it: {_permit('cap_ipc_lock')}")
    return notes


def schedule_realtime() -> None:
    """Set first-in-first-out scheduling for the present threads; raises PermissionError if that needs more rights."""
    for thread in _threads():
        os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(_REALTIME_PRIORITY))


def raise_descriptor_limit() -> None:
    """Raise this process's limit of descriptors to the system's, so that many strangers cannot lock others out."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


def _lock_memory() -> bool:
    # With a limit, later allocations would fail: worse than being swapped out.
    unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY
    if not (unlimited or _may_lock_without_limit()):
        return False
    # Only used pages: the stacks of all threads would be hundreds of megabytes.
    return bool(_libc().mlockall(_MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT) == 0)


def _may_lock_without_limit() -> bool:
    """Return whether this process has CAP_IPC_LOCK, which permits locking memory without a limit."""
    for line in Path("/proc/self/status").read_text(encoding="ascii", errors="replace").splitlines():
        if line.startswith("CapEff:"):
            return bool(int(line.split()[1], 16) >> _CAP_IPC_LOCK & 1)
    return False


def _raise_session() -> None:
    """Raise the session where there is one: then a thread's niceness counts only within it."""
    with contextlib.suppress(OSError):
        group = _SESSION.read_text(encoding="ascii").split()
        # Empty: this process began before the first session. High: the other side raised it, and restores it.
        if group and (before := int(group[-1])) > _NICENESS:
            _SESSION.write_text(str(_NICENESS), encoding="ascii")
            atexit.register(_restore_session, before)


def _restore_session(niceness: int) -> None:
    with contextlib.suppress(OSError):
        _SESSION.write_text(str(niceness), encoding="ascii")


def _threads() -> list[int]:
    return [int(entry.name) for entry in Path("/proc/self/task").iterdir()]


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def _permit(capability: str) -> str:
    limit = "rtprio 20" if capability == "cap_sys_nice" else "memlock unlimited"
    if Path("/.dockerenv").exists():
        return f"docker run --cap-add={capability.removeprefix('cap_').upper()} ..."
    return (
        f"echo '{os.environ.get('USER', 'YOU')} - {limit}' | sudo tee -a /etc/security/limits.d/feelahead.conf, "
        f"then log in again (or: sudo setcap cap_sys_nice,cap_ipc_lock+ep {Path(sys.executable).resolve()})"
    )
