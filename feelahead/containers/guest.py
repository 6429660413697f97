"""A router inside the router, for kernels without netem: User-Mode Linux, a Linux kernel that is an ordinary process.

It takes over both interfaces through raw sockets, with the container's own addresses, which the container's kernel
gives up meanwhile. Debian's package user-mode-linux has the kernel and its modules; what they lack (nft for IPv4) is
done with iptables.
"""

import contextlib
import json
import os
import shlex
import shutil
import signal
import struct
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from common.emulation.spec import Direction
from feelahead.containers.cable import PORTS, Cable, End, delays
from feelahead.containers.system import CommandFailedError, run_system

_KERNEL: Final = "linux.uml"
_MODULES: Final = Path("/usr/lib/uml/modules")
_INSERTED: Final = (
    *("sched/sch_tbf", "sched/sch_netem", "netfilter/x_tables"),
    *("ipv4/netfilter/nf_defrag_ipv4", "ipv6/netfilter/nf_defrag_ipv6"),
    *("netfilter/nf_conntrack", "netfilter/nf_nat", "ipv4/netfilter/ip_tables", "ipv4/netfilter/iptable_nat"),
    *("ipv4/netfilter/iptable_filter", "netfilter/xt_nat", "netfilter/xt_MASQUERADE", "netfilter/xt_tcpudp"),
    *("netfilter/xt_multiport", "netfilter/xt_conntrack"),
)
_LEAVES: Final[Mapping[Direction, str]] = {"to_robot": "vec1", "to_operator": "vec0"}
_MEMORY: Final = "64M"
_INCOMING: Final = b"".join(
    struct.pack("<HBBI", *instruction)
    for instruction in (
        (0x30, 0, 0, 0xFFFFF004),  # load the packet's type (SKF_AD_OFF + SKF_AD_PKTTYPE)
        (0x15, 0, 1, 4),  # PACKET_OUTGOING?
        (0x06, 0, 0, 0),  # then drop it
        (0x06, 0, 0, 0x40000),  # else take it whole
    )
)
"""A socket filter (BPF): without it the guest receives the frames that it sends itself."""


def is_there() -> bool:
    """Whether the kernel that is a process is installed."""
    return shutil.which(_KERNEL) is not None and _MODULES.is_dir()


class Guest:
    """The kernel that routes in our place, for one cable at a time."""

    def __init__(self, folder: Path) -> None:
        """`folder`: for what goes between us and it; on a file system that lets programs run."""
        self._folder = folder
        self._process: subprocess.Popen[bytes] | None = None
        self._taken: dict[tuple[int, str], str] = {}
        """The addresses that it has taken over, by interface."""

    @property
    def running(self) -> bool:
        """Whether it has been started and has not ended."""
        return self._process is not None and self._process.poll() is None

    @property
    def up(self) -> bool:
        """Whether it routes."""
        return self.running and (self._folder / "up").exists()

    def start(self, cable: Cable, words: Mapping[Direction, str]) -> None:
        """Let it take over both ends of `cable`; CommandFailedError where it may not."""
        self.stop()
        shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True)
        self.pass_on_to(cable.robot_address)
        filter_file, init = self._folder / "incoming.bpf", self._folder / "init"
        filter_file.write_bytes(_INCOMING)
        init.write_text(_init_script(self._folder, cable, words))
        init.chmod(0o755)
        for end in (cable.operator, cable.robot):
            run_system(["ip", "address", "flush", "dev", end.name])
            self._taken[end.number, end.mac] = end.address
        interfaces = [
            f"vec{number}:transport=raw,ifname={end.name},mac={end.mac},depth=128,bpffile={filter_file}"
            for number, end in enumerate((cable.operator, cable.robot))
        ]
        # What it prints is for whoever looks into the folder.
        console = (self._folder / "console").open("wb")
        try:
            self._process = subprocess.Popen(
                [
                    # Late, it would add to the delays that it is there for.
                    *("nice", "-n", "-20", "taskset", "-c", str(max(os.sched_getaffinity(0)))),
                    *(_KERNEL, f"mem={_MEMORY}", "root=/dev/root", "rootfstype=hostfs", "rootflags=/", "ro"),
                    *(f"init={init}", f"uml_dir={self._folder}/", "con=null", "con0=null,fd:1", "quiet"),
                    *interfaces,
                ],
                stdin=subprocess.DEVNULL,
                stdout=console,
                stderr=subprocess.STDOUT,
                env=os.environ | {"TMPDIR": str(self._folder)},
                start_new_session=True,
            )
        except OSError as error:
            raise CommandFailedError(f"{_KERNEL}: {error}") from error
        finally:
            console.close()

    def pass_on_to(self, robot_address: str) -> None:
        """From now on, within a second, the robot side is there."""
        new = self._folder / "robot.new"
        new.write_text(f"{robot_address}\n")
        new.replace(self._folder / "robot")

    def stop(self) -> None:
        """End it, and take the addresses back, as far as their interfaces are still there."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError):
                # Each of its programs is a process of ours, too.
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._process = None
        for shown in json.loads(run_system(["ip", "-json", "address"])):
            if (address := self._taken.pop((shown["ifindex"], shown.get("address", "")), None)) is not None:
                with contextlib.suppress(CommandFailedError):
                    run_system(["ip", "address", "replace", address, "dev", shown["ifname"]])
        self._taken.clear()

    def with_taken_addresses(self, shown: Mapping[str, Any]) -> Mapping[str, Any]:
        """What `ip` shows of an interface, with the address that the guest has of it."""
        address = self._taken.get((shown["ifindex"], shown.get("address", "")))
        if address is None:
            return shown
        local, _, length = address.partition("/")
        return {**shown, "addr_info": [{"family": "inet", "local": local, "prefixlen": int(length)}]}

    def ask_for_queues(self) -> None:
        """Let it count."""
        (self._folder / "count").touch()

    def queues(self) -> list[dict[str, Any]] | None:
        """What its tc has counted since it was asked; None as long as it has not."""
        if (self._folder / "count").exists():
            return None
        counted: list[dict[str, Any]] = json.loads((self._folder / "queues").read_text())
        return counted

    @staticmethod
    def leaves() -> Mapping[Direction, str]:
        """The interface by which each direction leaves it."""
        return _LEAVES


def _init_script(folder: Path, cable: Cable, words: Mapping[Direction, str]) -> str:
    """What its first process does: interfaces, rules, delays, and then looking for the robot and counting for ever."""
    there = f"-i vec0 -p tcp -m multiport --dports {','.join(map(str, PORTS))} -j"
    rules = [
        "-t nat -A POSTROUTING -o vec1 -j MASQUERADE",
        "-P FORWARD DROP",
        f"-A FORWARD -o vec1 {there} ACCEPT",
        "-A FORWARD -i vec1 -o vec0 -m conntrack --ctstate ESTABLISHED -j ACCEPT",
    ]
    # No program runs unless something is asked for, as starting one holds this kernel up for milliseconds: busybox's
    # shell can wait by itself.
    for_ever = f"""
        export tc=$(command -v tc)  # not busybox's own
        exec busybox sh -e -c '
        mkfifo /run/never
        exec 3<> /run/never
        while read -r now < /mnt/robot; do
            if [ "$now" != "$robot" ]; then
                iptables-legacy -t nat -F PREROUTING
                iptables-legacy -t nat -A PREROUTING {there} DNAT --to-destination $now
                robot=$now; echo up > /mnt/up
            fi
            if [ -e /mnt/count ]; then $tc -statistics -json qdisc show > /mnt/queues; rm /mnt/count; fi
            read -t 0.5 -r nothing <&3 || true
        done'
        """
    return "\n".join(
        [
            "#!/bin/sh",
            "set -e",
            "export PATH=/usr/sbin:/usr/bin:/sbin:/bin",
            "mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t tmpfs tmpfs /run",
            f"mount -t hostfs -o {folder} none /mnt",
            f"for name in {' '.join(_INSERTED)}; do busybox insmod {_MODULES}/*/kernel/net/$name.ko; done",
            "ip link set dev lo up",
            *_address(0, cable.operator),
            *_address(1, cable.robot),
            "echo 1 > /proc/sys/net/ipv4/ip_forward",
            *(f"iptables-legacy {rule}" for rule in rules),
            *(shlex.join(command) for command in delays(_LEAVES, words, cable.mtu)),
            for_ever,
        ]
    )


def _address(number: int, end: End) -> list[str]:
    return [f"ip address add {end.address} dev vec{number}", f"ip link set dev vec{number} up"]
