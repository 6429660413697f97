"""A trial over a wide area, and the row that comes of it."""

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from msgspec import Meta

from common.limits import check_limits
from tests.two_hosts.wide_area.way import Direction, WayWords


@dataclass(frozen=True)
class Trial:
    """One link, and what is done over it."""

    delay: Annotated[float, Meta(ge=0.0, le=5000.0)] = 100.0
    """Milliseconds each way."""
    loss: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.0
    """Per cent of packets, each way."""
    burst: Annotated[float, Meta(ge=0.0, le=5000.0)] = 0.0
    """Milliseconds in which all packets are lost, every 5 s, each way."""
    rate: Annotated[float, Meta(ge=0.0, le=1e4)] = 0.0
    """Mbit/s of the robot's uplink; 0: free."""
    falls_to: Annotated[float, Meta(ge=0.0, le=1e4)] = 0.0
    """Mbit/s of the robot's uplink from half of the time on; 0: it stays."""
    queue: Annotated[float, Meta(ge=0.0, le=1e5)] = 200.0
    """Milliseconds for which a packet may wait for the rate."""
    control: str = "reno"
    """TCP's congestion control in both hosts."""
    connections: Annotated[int, Meta(ge=0, le=64)] = 0
    """Connections of the operator side; 0: its default."""
    person: Literal["drives", "rests"] = "drives"
    """The scripted person, or hands that do nothing."""
    pictures: bool = False
    """A page looks at both views and the scene."""
    bulk: bool = False
    """A TCP transfer fills the robot's uplink."""
    observer: Literal["none", "reads", "stops"] = "none"
    """A second operator side; `stops`: it is stopped (SIGSTOP) after a third of the time."""
    seconds: Annotated[float, Meta(ge=2.0, le=3600.0)] = 20.0
    """Length, from the operator side's start on."""

    def __post_init__(self) -> None:
        check_limits(self)

    def ways(self) -> dict[Direction, WayWords]:
        """The link in SI units, at first."""
        words = WayWords(self.delay / 1e3, self.loss / 1e2, self.burst / 1e3, queue_s=self.queue / 1e3)
        return {"to_operator": replace(words, rate_bit_s=1e6 * self.rate), "to_robot": words}


@dataclass(frozen=True)
class Outcome:
    """The row; None where nothing was measured. Ages are those of what is applied: late messages were overtaken."""

    to_operator_p50_ms: float | None
    to_operator_p95_ms: float | None
    to_operator_p99_ms: float | None
    """At its arrival, from the link's start on."""
    to_robot_p50_ms: float | None
    to_robot_p95_ms: float | None
    to_robot_p99_ms: float | None
    """In each tick that moves the arm: a command is held for up to 16 ms, until the next."""
    slowest_to_operator_ms: float | None
    """p99 of every arrival, late ones included."""
    slowest_to_robot_ms: float | None
    to_operator_gaps_min: float
    """Silences of more than 100 ms, a minute."""
    to_robot_gaps_min: float
    queueing_p95_ms: float | None
    """The age of haptics at the operator beyond the link's own delay."""
    armed: float
    """Share of the statuses from the first armed one on; 0 when it never was."""
    armed_after_s: float | None
    stops: int
    why: str
    """The stops' reasons, each once."""
    done: bool
    """The target was placed."""
    to_operator_kbit_s: float
    to_operator_packets_s: float
    to_robot_kbit_s: float
    to_robot_packets_s: float
    lost: int
    dropped: int
    link_queue_p95_ms: float
    """The time for which packets to the operator waited for the rate."""
    late_after_fall_s: float | None
    """The time after the fall of the rate at which a message last came 100 ms later than by the link's own delay."""
    pictures_s: float | None
    picture_p50_ms: float | None
    picture_p95_ms: float | None
    bulk_kbit_s: float | None
    late_p99_ms: float
    """The forwarder's own lateness."""
    late_max_ms: float
    realtime: bool
