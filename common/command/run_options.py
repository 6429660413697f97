"""Flags of every command that runs a side."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from common.command.status import StatusMode
from common.emulation.clauses import LinkModel
from common.emulation.spec import LinkSpec
from common.errors import ConfigurationError
from common.files.output_file import require_output_file
from common.periods import PERIODS_S, TURN, period_text
from common.recording.side import require_recordable
from common.units import parse_duration

_LARGEST_ASYMMETRY_S = 10.0
TickPeriod = Annotated[str, tyro.conf.arg(metavar="TIME")]
"""Period of a side's turns, such as 4ms; `tick_period_s` checks it"""


def tick_period_s(text: str) -> float:
    """Return the period in seconds; ConfigurationError names --tick-period if it is no time or out of range."""
    period_s = parse_duration(text, "--tick-period")
    if not PERIODS_S[0] <= period_s <= PERIODS_S[-1]:
        valid = f"{period_text(PERIODS_S[0])} to {period_text(PERIODS_S[-1])}"
        raise ConfigurationError(f"--tick-period {text} is out of range; valid: {valid}")
    return period_s


@dataclass(frozen=True)
class RunOptions:
    """Options of a run: emulated link, duration, recording and output."""

    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """TOML file with settings, which flags override; every flag's name is a key of the file."""
    link: Annotated[str, tyro.conf.arg(metavar="SPEC")] = ""
    """Emulated link for this side's messages, in netem's words, such as "delay 50ms 10ms distribution normal loss 1%".
    Further words are duplicate, corrupt, reorder, rate and limit, and also "trace FILE.csv" (a column delay_ns, or
    sent_ns and received_ns, in nanoseconds) and "outage 2s at 10s every 30s" (counted from the first message). Each
    direction and stream may have its own link: "to_robot: delay 20ms; to_operator: delay 50ms 10ms; video: rate 2mbit;
    to_operator.telemetry: loss 5%". A name is valid, too: lan, wifi, lte, low-orbit, intercontinental, satellite."""
    link_model: LinkModel = "datagram"
    """How the emulated link treats messages. datagram: they are lost and reordered as with UDP. stream: they keep their
    order as with TCP, so that a loss becomes a delay."""
    asymmetry: Annotated[str, tyro.conf.arg(metavar="TIME")] = "0ms"
    """Least delay to the robot side minus least delay to the operator side (12ms or -12ms), if known from elsewhere.
    The sides' messages cannot show it, and half of it would enter the estimated clock offset as an error."""
    tick_period: TickPeriod = TURN
    """Period of this side's turns, 1ms to 20ms. A machine that cannot keep it takes a longer one by itself, and says
    so. The physics keeps the model's timestep."""
    full_rate: bool = False
    """For comparison, send a stiffness and a command in every turn. Otherwise messages are sent only if they change
    what is felt or commanded, and at least 50 a second."""
    duration: Annotated[float | None, tyro.conf.arg(metavar="SECONDS")] = None
    """End after so many seconds; by default the run ends at Ctrl-C."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """Seed of all random numbers: the same seed gives the same noise and delays."""
    summary: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """Write the run's figures to this file at the end."""
    record: Annotated[Path | None, tyro.conf.arg(metavar="FILE.mcap")] = None
    """Record the run into this new file, which can be viewed, exported, and replayed bit for bit."""
    status: StatusMode = "line"
    """Status output. line: a live line for people. json: JSON lines for programs. facts: JSON lines with all that the
    console shows. none: no output."""

    def __post_init__(self) -> None:
        self.link_spec()
        if abs(self.asymmetry_s()) > _LARGEST_ASYMMETRY_S:
            raise ValueError(
                f"--asymmetry {self.asymmetry} is out of range;"
                f" valid: -{_LARGEST_ASYMMETRY_S:g}s to {_LARGEST_ASYMMETRY_S:g}s"
            )
        self.tick_period_s()
        if self.duration is not None and not 0.0 < self.duration < 1e6:
            raise ValueError(f"--duration {self.duration} is out of range; valid: above 0 and below 1000000 seconds")
        if self.seed < 0:
            raise ValueError(f"--seed {self.seed}: is negative; valid: 0 or a larger whole number")
        require_output_file("--summary", self.summary)
        require_recordable(self.record)

    def link_spec(self) -> LinkSpec:
        """Return the emulated link with this run's seed; raises ConfigurationError if `link` is invalid."""
        return LinkSpec.parse(self.link, max(0, self.seed), self.link_model)

    def tick_period_s(self) -> float:
        """Return `tick_period` in seconds; raises ConfigurationError if it is no time or out of range."""
        return tick_period_s(self.tick_period)

    def asymmetry_s(self) -> float:
        """Return `asymmetry` in seconds, positive or negative; raises ConfigurationError if it is no time."""
        text = self.asymmetry.strip()
        return -parse_duration(text[1:], "--asymmetry") if text.startswith("-") else parse_duration(text, "--asymmetry")


@dataclass(frozen=True)
class SideOptions(RunOptions):
    """Options of a side that runs in its own process."""

    realtime: bool = False
    """Use real-time scheduling and locked memory; if they are not permitted, a note names the command that permits
    them.
    """
