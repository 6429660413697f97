"""A cable that is really pulled: a virtual Ethernet link between network namespaces, set down in mid-motion.

Needs root and iproute2's `ip`; without them the row says so.
"""

import contextlib
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

from common.errors import FeelaheadError
from feelahead.experiments.faults.fault import Outcome
from feelahead.experiments.faults.real_faults import Advance, Onsets
from feelahead.experiments.faults.rig import Rig, RigError, stands

ROBOT, OPERATOR = "10.91.83.1", "10.91.83.2"
"""Inside namespaces of our own, where no other network is."""


class NotPermittedError(FeelaheadError):
    """Network namespaces cannot be had here."""


def unplugged(repeats: int, advance: Advance) -> Outcome:
    """Both sides in namespaces of their own; the link between them is set down while the arm moves, then up again."""
    onsets, safe = Onsets(), True
    try:
        with namespaces() as (robot, operator), Rig(f"tcp://{ROBOT}:5555", ["--insecure"], robot) as rig:
            driver = rig.driver(before=operator)
            for _ in rig.rounds(repeats, advance, 120.0):
                evenly = rig.drive(driver)
                rig.lines()
                _ip("-n", robot[-1], "link", "set", "robot0", "down")
                told = onsets.take(rig, evenly=evenly)["told_to_move"]
                rig.wait(0.5)
                _ip("-n", robot[-1], "link", "set", "robot0", "up")
                rig.until(driver, "phase", "rest")
                figures = rig.figures()
                safe &= figures["told_to_move"] == told and stands(figures)
    except NotPermittedError as error:
        return Outcome(True, f"skipped: {error}", judged=False)
    return onsets.outcome(safe=safe)


@contextlib.contextmanager
def namespaces() -> Iterator[tuple[list[str], list[str]]]:
    """The commands that run a program in either namespace; both are gone afterwards.

    NotPermittedError where there can be none.
    """
    if shutil.which("ip") is None or os.geteuid() != 0:
        raise NotPermittedError("network namespaces need root and iproute2 (apt install iproute2)")
    robot, operator = (f"feelahead-{side}-{os.getpid()}" for side in ("robot", "operator"))
    try:
        _delete_left_behind()
        for name in (robot, operator):
            added = _run_ip("netns", "add", name)
            if added is not None:
                raise NotPermittedError(added)
        link = ("robot0", "type", "veth", "peer", "name", "operator0")
        _ip("-n", robot, "link", "add", *link)
        _ip("-n", robot, "link", "set", "operator0", "netns", operator)
        for name, device, address in ((robot, "robot0", ROBOT), (operator, "operator0", OPERATOR)):
            _ip("-n", name, "address", "add", f"{address}/24", "dev", device)
            _ip("-n", name, "link", "set", device, "up")
            _ip("-n", name, "link", "set", "lo", "up")
        yield ["ip", "netns", "exec", robot], ["ip", "netns", "exec", operator]
    finally:
        for name in (robot, operator):
            _run_ip("netns", "del", name)


def _delete_left_behind() -> None:
    """Namespaces of runs that were killed: their names end with a process that is no more."""
    for namespace in Path("/run/netns").glob("feelahead-*-*"):
        owner = namespace.name.rpartition("-")[2]
        if owner.isdigit() and not Path("/proc", owner).exists():
            _run_ip("netns", "del", namespace.name)


def _ip(*arguments: str) -> None:
    """RigError when it fails: what may be missing was asked for before."""
    failed = _run_ip(*arguments)
    if failed is not None:
        raise RigError(failed)


def _run_ip(*arguments: str) -> str | None:
    """Why it failed; None when it did not."""
    done = subprocess.run(["ip", *arguments], capture_output=True, text=True, check=False)  # noqa: S607
    return None if done.returncode == 0 else f"ip {' '.join(arguments)}: {done.stderr.strip()}"
