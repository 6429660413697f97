"""Sender, router and receiver, each in a separate network namespace, joined by veth pairs."""

import ctypes
import os
import subprocess
from typing import Final

SENDER: Final = "10.77.1.1"
RECEIVER: Final = "10.77.2.1"
_ROUTER_ENDS: Final = {"sender": "10.77.1.2", "receiver": "10.77.2.2"}
_ENDS: Final = {"sender": SENDER, "receiver": RECEIVER}
_CLONE_NEWNET: Final = 0x40000000


def join_namespaces() -> None:
    """Make the three namespaces and connect them; needs root, in a virtual machine that has no others."""
    for name in ("router", *_ENDS):
        _ip(f"netns add {name}")
        _ip(f"-n {name} link set dev lo up")
    for name, address in _ENDS.items():
        router = _ROUTER_ENDS[name]
        _ip(f"-n {name} link add eth0 type veth peer name to-{name} netns router")
        _ip(f"-n {name} address add {address}/24 dev eth0")
        _ip(f"-n router address add {router}/24 dev to-{name}")
        # A packet on a wire has one segment; a veth pair would carry many at once, to be delayed or lost together.
        _ip(f"-n {name} link set dev eth0 up gso_max_segs 1")
        _ip(f"-n router link set dev to-{name} up")
        _ip(f"-n {name} route add default via {router}")
    _run(["ip", "netns", "exec", "router", "sh", "-c", "echo 1 > /proc/sys/net/ipv4/ip_forward"])


def set_netem(words: str) -> None:
    """Apply netem with these words to both interfaces on which the router sends: one for each direction."""
    for name in _ENDS:
        # Another qdisc first: netem replaced by netem would keep its table.
        _run(["tc", "-n", "router", "qdisc", "replace", "dev", f"to-{name}", "root", "pfifo"])
        _run(["tc", "-n", "router", "qdisc", "replace", "dev", f"to-{name}", "root", "netem", *words.split()])


def enter(name: str) -> None:
    """Move this thread into a network namespace.

    Threads that it starts from now on are in this namespace, too. A socket stays in the namespace where it was made.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    descriptor = os.open(f"/run/netns/{name}", os.O_RDONLY)
    try:
        if libc.setns(descriptor, _CLONE_NEWNET) != 0:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), name)
    finally:
        os.close(descriptor)


def _ip(words: str) -> None:
    _run(["ip", *words.split()])


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()}")
