"""Flags of every running side."""

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
    """Options of a run: emulated link, duration, recording and output."""

    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """Settings from a file, which flags override; every flag's name is a key."""
    link: Annotated[str, tyro.conf.arg(metavar="SPEC")] = ""
    """Emulated link for this side's messages, in netem's words: "delay 50ms 10ms distribution normal loss 1%", with
    duplicate, corrupt, reorder, rate and limit, and "trace FILE.csv" or "outage 2s at 10s every 30s" (after the first
    message); or per direction and stream: "to_robot: delay 20ms; to_operator: delay 50ms 10ms; video: rate
    2mbit; to_operator.telemetry: loss 5%". Or by name: lan, wifi, lte, low-orbit, intercontinental, satellite."""
    link_model: LinkModel = "datagram"
    """datagram loses and reorders messages like UDP; stream keeps their order like TCP, so that loss becomes delay."""
    asymmetry: Annotated[str, tyro.conf.arg(metavar="TIME")] = "0ms"
    """Least delay to the robot minus that to the operator (12ms, or -12ms), if known from elsewhere: messages between
    two clocks cannot show it. Half of it would be an error of the clock offset."""
    full_rate: bool = False
    """Send a stiffness each millisecond and 250 commands a second, for comparison: otherwise only those that change
    what is felt, and 50 a second."""
    duration: Annotated[float | None, tyro.conf.arg(metavar="SECONDS")] = None
    """End after this time; by default at Ctrl-C."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """Seed of all random numbers: the same seed gives the same noise and delays."""
    summary: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """Write the run's figures to this file at the end."""
    record: Annotated[Path | None, tyro.conf.arg(metavar="FILE.mcap")] = None
    """Record the run into a new file, to view, export and replay it bit for bit."""
    status: StatusMode = "line"
    """A live line for people, JSON lines for programs, JSON lines with all that the console shows, or nothing."""

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
        """Return the emulated link, with this run's seed; raises ConfigurationError if it is invalid."""
        return LinkSpec.parse(self.link, max(0, self.seed), self.link_model)

    def asymmetry_s(self) -> float:
        """Return `asymmetry` in seconds, with its sign; raises ConfigurationError if it is no time."""
        text = self.asymmetry.strip()
        return -parse_duration(text[1:], "--asymmetry") if text.startswith("-") else parse_duration(text, "--asymmetry")


@dataclass(frozen=True)
class SideOptions(RunOptions):
    """Options of a side in a separate process."""

    realtime: bool = False
    """Real-time scheduling and locked memory; if not permitted, a note names the command that permits them."""
