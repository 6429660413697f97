"""Process that emulates a wide-area network: it passes packets between two namespaces with a TUN device each.

It makes the namespaces. When its standard input ends, it deletes them and kills all programs in them, so nothing is
left even if its parent is killed. The first input line of JSON (`Order`) starts it; for each further line
it prints the counts since the line before.
"""

import contextlib
import ctypes
import fcntl
import heapq
import os
import select
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from common.realtime.priority import raise_priority, schedule_realtime
from tests.two_hosts.wide_area.wire_direction import Counts, Direction, DirectionSettings, Wire

DEVICE: Final = "wan0"
ADDRESSES: Final[dict[str, str]] = {"robot": "10.78.0.1", "operator": "10.78.0.2"}
_LEAVING: Final[tuple[Direction, ...]] = ("to_operator", "to_robot")
"""Direction in which each host sends, in the order of `ADDRESSES`"""
_CLONE_NEWNET: Final = 0x40000000
_TUNSETIFF: Final = 0x400454CA
_TUN_WITHOUT_HEADER: Final = 0x1001
_CONTROLS: Final = Path("/proc/sys/net/ipv4/tcp_available_congestion_control")
_IN_A_ROW: Final = 64
"""Maximum number of packets read from a device before due packets are delivered"""


class Order(msgspec.Struct, frozen=True):
    ways: dict[Direction, DirectionSettings]
    """Settings of directions; a direction without settings does nothing to packets"""
    control: str | None = None
    """TCP congestion control of both hosts; None: the machine's default"""
    seed: int = 0


@contextlib.contextmanager
def _inside(namespace: str) -> Iterator[None]:
    """Move this thread into a network namespace during the context."""
    libc = ctypes.CDLL(None, use_errno=True)
    with contextlib.ExitStack() as stack:
        for path in ("/proc/self/ns/net", f"/run/netns/{namespace}"):
            descriptor = os.open(path, os.O_RDONLY)
            stack.callback(os.close, descriptor)
            if path.startswith("/proc"):
                stack.callback(libc.setns, descriptor, _CLONE_NEWNET)
            elif libc.setns(descriptor, _CLONE_NEWNET):
                raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), path)
        yield


def _ip(*words: str) -> None:
    done = subprocess.run(["ip", *words], capture_output=True, text=True, check=False)  # noqa: S607
    if done.returncode:
        raise RuntimeError(f"ip {' '.join(words)}: {done.stderr.strip()}")


@contextlib.contextmanager
def _hosts(control: str | None) -> Iterator[tuple[dict[str, str], list[int]]]:
    """Make both namespaces; yield their names by host, and the descriptors of their TUN devices."""
    namespaces = {host: f"feelahead-wide-{host}-{os.getpid()}" for host in ADDRESSES}
    descriptors = []
    try:
        for host, namespace in namespaces.items():
            _ip("netns", "add", namespace)
            with _inside(namespace):
                descriptors.append(descriptor := os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK))
                fcntl.ioctl(descriptor, _TUNSETIFF, struct.pack("16sH", DEVICE.encode(), _TUN_WITHOUT_HEADER))
                if control is not None and control not in (here := _CONTROLS.read_text().split()):
                    raise RuntimeError(f"congestion control {control!r}; valid on this machine: {', '.join(here)}")
            _ip("-n", namespace, "link", "set", "lo", "up")
            _ip("-n", namespace, "address", "add", f"{ADDRESSES[host]}/32", "dev", DEVICE)
            # Without IPv6 addresses the device sends nothing by itself.
            _ip("-n", namespace, "link", "set", DEVICE, "addrgenmode", "none", "up")
            route = ("route", "add", "10.78.0.0/24", "dev", DEVICE, "src", ADDRESSES[host])
            # The route decides: a namespace's default is limited to the controls allowed to all users of the machine.
            _ip("-n", namespace, *route, *(() if control is None else ("congctl", control)))
        yield namespaces, descriptors
    finally:
        for namespace in namespaces.values():
            _delete(namespace)


def _delete(namespace: str) -> None:
    words = ["ip", "netns", "pids", namespace]
    found = subprocess.run(words, capture_output=True, text=True, check=False)
    for pid in map(int, found.stdout.split()):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    subprocess.run(["ip", "netns", "del", namespace], capture_output=True, check=False)  # noqa: S607


class _Forwarder:
    def __init__(self, order: Order, devices: list[int], *, realtime: bool) -> None:
        now_s, given = time.monotonic(), order.ways
        self._ways = [Wire(given.get(name, DirectionSettings()), order.seed, name, now_s) for name in _LEAVING]
        self._devices = devices
        self._realtime = realtime
        self._due: list[tuple[float, int, int, bytes]] = []
        self._number = self._failed = 0
        self._late_s: list[float] = []
        self._said_s = now_s

    def run(self) -> None:
        """Forward packets, and print counts for each line, until the standard input ends."""
        orders = sys.stdin.fileno()
        while True:
            wait_s = max(0.0, self._due[0][0] - time.monotonic()) if self._due else None
            readable = select.select([*self._devices, orders], [], [], wait_s)[0]
            self._deliver()
            for number, device in enumerate(self._devices):
                if device in readable:
                    self._read(number)
            self._deliver()
            if orders in readable:
                line = sys.stdin.readline()
                if not line:
                    return
                _say(self._counts())

    def _read(self, number: int) -> None:
        for _ in range(_IN_A_ROW):
            try:
                packet = os.read(self._devices[number], 2048)
            except BlockingIOError:
                return
            due_s = self._ways[number].take(len(packet), time.monotonic())
            if due_s is not None:
                self._number += 1
                heapq.heappush(self._due, (due_s, self._number, self._devices[1 - number], packet))

    def _deliver(self) -> None:
        while self._due and (late_s := time.monotonic() - self._due[0][0]) >= 0.0:
            _, _, device, packet = heapq.heappop(self._due)
            self._late_s.append(late_s)
            try:
                os.write(device, packet)
            except OSError:
                self._failed += 1

    def _counts(self) -> dict[str, Any]:
        now_s = time.monotonic()
        late_ms = 1e3 * np.array(self._late_s or [0.0])
        figures: dict[str, Any] = {
            "seconds": now_s - self._said_s,
            "late_p99_ms": float(np.quantile(late_ms, 0.99)),
            "late_max_ms": float(late_ms.max()),
            "failed": self._failed,
            "realtime": self._realtime,
        }
        for name, way in zip(_LEAVING, self._ways, strict=True):
            figures[name] = way.counts.summary()
            way.counts = Counts()
        self._said_s, self._late_s, self._failed = now_s, [], 0
        return figures


def _say(what: dict[str, Any]) -> None:
    sys.stdout.write(msgspec.json.encode(what).decode() + "\n")
    sys.stdout.flush()


def _main() -> None:
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    try:
        order = msgspec.json.decode(sys.stdin.readline(), type=Order)
        with _hosts(order.control) as (namespaces, devices):
            raise_priority()
            realtime = True
            try:
                schedule_realtime()
            except OSError:
                realtime = False
            _say({"namespaces": namespaces})
            _Forwarder(order, devices, realtime=realtime).run()
    except (OSError, RuntimeError, msgspec.MsgspecError) as error:
        _say({"error": str(error)})


if __name__ == "__main__":
    _main()
