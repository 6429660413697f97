"""Two simulated machines on one cable: two network namespaces, joined by a virtual Ethernet link.

Needs root and iproute2's `ip`: without them tests are skipped.
"""

import contextlib
import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

_PREFIX_BITS = 24
_FOLDERS = (Path("/run/netns"), Path("/etc/netns"))
"""Folder of the namespaces, and folder of the files that `ip` mounts over /etc in each namespace"""


@dataclass
class Machine:
    """One of the two simulated machines: a network namespace with one end of the cable."""

    namespace: str
    device: str
    """Name of the network device at this machine's end of the cable"""
    address: str

    @property
    def surroundings(self) -> list[str]:
        """Command prefix that runs a program on this machine."""
        return ["ip", "netns", "exec", self.namespace]

    @property
    def own_files(self) -> Path:
        """Folder whose files replace those of /etc, for programs that start on this machine from now on."""
        return Path("/etc/netns") / self.namespace

    def unplug(self) -> None:
        """Take the link down: neither end has a carrier."""
        self.set_link("down")

    def plug_in(self) -> None:
        """Take the link up again."""
        self.set_link("up")

    def set_link(self, *words: str) -> None:
        """Run `ip link set DEVICE WORDS` for this machine's end of the cable."""
        _ip("-n", self.namespace, "link", "set", self.device, *words)

    def readdress(self, address: str) -> None:
        """Replace the present address, as a new DHCP lease does."""
        _ip("-n", self.namespace, "address", "flush", "dev", self.device)
        self.address = address
        _ip("-n", self.namespace, "address", "add", f"{address}/{_PREFIX_BITS}", "dev", self.device)


@contextlib.contextmanager
def two_machines(robot: str = "198.18.0.1", operator: str = "198.18.0.2") -> Iterator[tuple[Machine, Machine]]:
    """Yield the robot's and the operator's machine with these addresses; skip the test if none can be made here."""
    if shutil.which("ip") is None or os.geteuid() != 0:
        pytest.skip("network namespaces need root and iproute2 (apt install iproute2)")
    machines = one, other = (
        Machine(f"feelahead-robot-{os.getpid()}", "robot0", robot),
        Machine(f"feelahead-operator-{os.getpid()}", "operator0", operator),
    )
    try:
        _delete_left_behind()
        try:
            _connect(*machines)
        except AssertionError as error:
            pytest.skip(str(error))
        yield one, other
    finally:
        for machine in machines:
            _delete(machine.namespace)


def _connect(one: Machine, other: Machine) -> None:
    for machine in (one, other):
        _ip("netns", "add", machine.namespace)
    _ip("-n", one.namespace, "link", "add", one.device, "type", "veth", "peer", "name", other.device)
    _ip("-n", one.namespace, "link", "set", other.device, "netns", other.namespace)
    for machine in (one, other):
        machine.readdress(machine.address)
        machine.plug_in()
        _ip("-n", machine.namespace, "link", "set", "lo", "up")


def _delete_left_behind() -> None:
    """Delete namespaces of killed test runs, whose names end with the id of a process that is gone."""
    for folder in _FOLDERS:
        for left in folder.glob("feelahead-*-*"):
            owner = left.name.rpartition("-")[2]
            if owner.isdigit() and not Path("/proc", owner).exists():
                _delete(left.name)


def _delete(namespace: str) -> None:
    _run_ip("netns", "del", namespace)
    for files in Path("/etc/netns").glob(namespace):
        shutil.rmtree(files, ignore_errors=True)
        with contextlib.suppress(OSError):  # The folder may hold files of other namespaces.
            files.parent.rmdir()


def _ip(*arguments: str) -> None:
    """Run `ip`; AssertionError with the reason if it fails."""
    failed = _run_ip(*arguments)
    assert failed is None, failed


def _run_ip(*arguments: str) -> str | None:
    """Run `ip`; return the reason if it fails, else None."""
    done = subprocess.run(["ip", *arguments], capture_output=True, text=True, check=False)  # noqa: S607
    return None if done.returncode == 0 else f"ip {' '.join(arguments)}: {done.stderr.strip()}"
