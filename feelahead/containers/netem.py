"""Arguments of the kernel's netem for a link, and the check whether netem can emulate it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

from common.emulation.profile import LinkProfile
from common.emulation.spec import Direction, LinkSpec
from common.errors import FeelaheadError
from feelahead.containers.cable import HANDLES

CARRIED: tuple[Literal["haptics", "telemetry"], ...] = ("haptics", "telemetry")
"""Streams between the sides; netem cannot tell them apart, as they share the interfaces."""
_NOTHING = "delay 0ms"


class BeyondNetemError(FeelaheadError):
    """The link asks for something that the kernel's netem cannot do; the text names it."""


def netem_words(link: LinkSpec) -> dict[Direction, str]:
    """Return the arguments of `tc qdisc ... netem` for each direction.

    Raises BeyondNetemError if netem cannot emulate the link. netem sees packets, neither messages nor streams, so both
    ports of a direction get the same link.
    """
    return {direction: _direction_words(link, direction) for direction in get_args(Direction)}


@dataclass(frozen=True)
class Counted:
    """Packets that one direction's netem has passed and dropped since it was set up."""

    sent: int
    dropped: int

    def lost_share_since(self, before: "Counted") -> float | None:
        """Return the share of packets lost since the count `before`.

        None if no packet came since, or if netem was set up again.
        """
        if self.sent < before.sent or self.dropped < before.dropped:
            return None
        dropped = self.dropped - before.dropped
        came = self.sent - before.sent + dropped
        return dropped / came if came > 0 else None


def count_packets(queues: Iterable[Mapping[str, Any]]) -> dict[Direction, Counted]:
    """Read the packets of each direction's netem from the output of `tc -statistics -json qdisc show`."""
    netems = {queue["handle"]: queue for queue in queues if queue["kind"] == "netem"}
    return {
        direction: Counted(netems[handle]["packets"], netems[handle]["drops"])
        for direction, handle in HANDLES.items()
        if handle in netems
    }


def _direction_words(link: LinkSpec, direction: Direction) -> str:
    words = {link.profile(direction, stream).words for stream in CARRIED}
    if len(words) > 1:
        raise BeyondNetemError(f"{direction}: its streams have different links, and netem cannot tell streams apart")
    if (beyond := _beyond(link.profile(direction))) is not None:
        raise BeyondNetemError(f"{direction}: {beyond}")
    return words.pop() or _NOTHING


def _beyond(profile: LinkProfile) -> str | None:
    if profile.distribution == "exponential":
        return "a distribution that tc has no table of"
    for name, there in (
        ("trace", profile.trace is not None),
        ("outage", bool(profile.outages)),
        ("retransmit", profile.retransmit_s is not None),
    ):
        if there:
            return f"{name} is not among tc's words"
    return None
