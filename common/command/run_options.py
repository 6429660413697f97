"""The flags that every running side has in common."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from common.command.status import StatusMode
from common.emulation.clauses import LinkModel
from common.emulation.spec import LinkSpec
from common.files.output_file import require_output_file
from common.recording.side import require_recordable
from common.units import parse_duration

_LARGEST_ASYMMETRY_S = 10.0


@dataclass(frozen=True)
class RunOptions:
    """What to emulate, how long to run, and what to say about it."""

    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """Settings from a file, under these flags; every flag's name is a key."""
    link: Annotated[str, tyro.conf.arg(metavar="SPEC")] = ""
    """Emulated link for what this side sends, in netem's words: "delay 50ms 10ms distribution normal loss 1%", with
    duplicate, corrupt, reorder, rate and limit, and "trace FILE.csv" or "outage 2s at 10s every 30s" (after the first
    message); or per direction and stream: "to_robot: delay 20ms; to_operator: delay 50ms 10ms; video: rate
    2mbit; to_operator.telemetry: loss 5%". Or by name: lan, wifi, lte, low-orbit, intercontinental, satellite."""
    link_model: LinkModel = "datagram"
    """datagram loses and reorders messages as UDP does; stream keeps them in order as TCP does, and loss becomes
    delay."""
    asymmetry: Annotated[str, tyro.conf.arg(metavar="TIME")] = "0ms"
    """By how much the least delay to the robot exceeds that to the operator (12ms, or -12ms), where that is known from
    elsewhere: no exchange of messages between two clocks can tell. Half of it would be an error of the offset."""
    full_rate: bool = False
    """Send a stiffness each millisecond and 250 commands a second, whatever they say, to compare with: otherwise one
    leaves as soon as it would be felt, and 50 times a second."""
    duration: Annotated[float | None, tyro.conf.arg(metavar="SECONDS")] = None
    """End after this long; without it, at Ctrl-C."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """For every random draw: the same seed gives the same noise and delays."""
    summary: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """Write the run's figures there at the end."""
    record: Annotated[Path | None, tyro.conf.arg(metavar="FILE.mcap")] = None
    """Record the run into a new file: all that happened, to be looked at, exported, and computed anew bit for bit."""
    status: StatusMode = "line"
    """A live line for people, JSON lines for programs, the same with all that the console shows, or nothing."""

    def __post_init__(self) -> None:
        self.link_spec()
        if abs(self.asymmetry_s()) > _LARGEST_ASYMMETRY_S:
            raise ValueError(
                f"--asymmetry {self.asymmetry}: valid: -{_LARGEST_ASYMMETRY_S:g}s to {_LARGEST_ASYMMETRY_S:g}s"
            )
        if self.duration is not None and not 0.0 < self.duration < 1e6:
            raise ValueError(f"--duration {self.duration}: valid: above 0 and below 1000000 seconds")
        if self.seed < 0:
            raise ValueError(f"--seed {self.seed}: valid: 0 or a larger whole number")
        require_output_file("--summary", self.summary)
        require_recordable(self.record)

    def link_spec(self) -> LinkSpec:
        """The emulated link, with this run's seed; ConfigurationError for a bad one."""
        return LinkSpec.parse(self.link, max(0, self.seed), self.link_model)

    def asymmetry_s(self) -> float:
        """`asymmetry` in seconds, with its sign; ConfigurationError for what is no time."""
        text = self.asymmetry.strip()
        return -parse_duration(text[1:], "--asymmetry") if text.startswith("-") else parse_duration(text, "--asymmetry")


@dataclass(frozen=True)
class SideOptions(RunOptions):
    """The flags of a side that is a process of its own."""

    realtime: bool = False
    """Real-time scheduling and locked memory; where that is not permitted, a note says what permits it."""
