"""From a change of stiffness to the write to the controller: the real operator process, on loopback.

    feelahead bench effects

The robot side's end sends a field every millisecond, and now and then lets R2 stiffen, or disarms, so that it is
released: what has to be felt at once (strength that only falls takes a tenth of a second by design). The operator side
runs as always, but for its controller, whose handle notes when each report is written instead of handing it to the
system. What the system and the cable add comes on top: on USB a report waits for its turn of some milliseconds.
"""

import multiprocessing
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Annotated, Any, Final

import numpy as np
import tyro
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common.clock import MonotonicClock
from common.command.command_line import parse_settings
from common.errors import FeelaheadError
from feelahead.benchmarks.effects.stiffness_source import StiffnessSource
from operator_side.dualsense.hid.device import HidHandle
from operator_side.dualsense.reports.controller_state import ControllerState
from operator_side.dualsense.reports.input_report import build_input_report
from operator_side.dualsense.reports.transport import Transport
from operator_side.main import command as operator_command

PROGRAM = "feelahead bench effects"
GOAL_P99_MS: Final = 2.0
_REPORT_PERIOD_S: Final = 0.004
_STRENGTH: Final = 7
_SHORTEST_HOLD_S, _LONGEST_HOLD_S = 0.03, 0.06
"""A stiffness holds for so long: at random, so that no beat with the loop's own periods is mistaken for speed."""
_REST_S: Final = 3.0
_PATIENCE_S: Final = 120.0

Stamps = list[tuple[float, bytes]]


@dataclass(frozen=True)
class EffectLatencySettings:
    """How long it takes from a change of stiffness until the controller is told."""

    changes: Annotated[int, tyro.conf.arg(metavar="N")] = 500
    """So many times R2 is released, or stiffens."""
    quick: bool = False
    """Fifty of them."""
    transport: Annotated[str, tyro.conf.arg(metavar="usb|bluetooth")] = "usb"
    """Which reports are made: over Bluetooth each has a checksum."""
    realtime: bool = False
    """The operator side with --realtime."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """For when each change comes."""

    def __post_init__(self) -> None:
        if not 1 <= self.changes <= 100_000:
            raise ValueError(f"--changes {self.changes}: valid: 1 to 100000")
        if self.transport not in ("usb", "bluetooth"):
            raise ValueError(f"--transport {self.transport}: valid: usb, bluetooth")
        if self.seed < 0:
            raise ValueError(f"--seed {self.seed}: valid: 0 or a larger whole number")


@dataclass(frozen=True)
class Outcome:
    """One run."""

    latencies_s: np.ndarray
    """(n,) from the sending of each new stiffness to the first write after it; NaN: nothing was written."""
    writes: int
    """While stiffness changed."""
    writes_at_rest: int
    """While it did not, for `rest_s`."""
    rest_s: float
    longest_pause_s: float
    """From one turn to the next of either end: a busy machine may keep them so long that the effect is let go."""


class StampingHandle:
    """hidapi's handle on a controller that nobody touches; notes when it is written to."""

    longest_pause_s = 0.0
    """From one look for a report to the next."""

    def __init__(self, transport: Transport, stamps: Stamps) -> None:
        self._clock = MonotonicClock()
        self._report = list(build_input_report(ControllerState(), transport))
        self._reported_s = self._looked_s = self._clock.now()
        self._stamps = stamps

    def open_path(self, path: bytes) -> None:
        """There is nothing to open."""
        del path

    def set_nonblocking(self, flag: int) -> int:
        """It never blocks."""
        return flag - flag

    def read(self, max_length: int, timeout_ms: int = 0) -> list[int]:
        """A report every 4 ms."""
        now_s = self._clock.now()
        StampingHandle.longest_pause_s = max(StampingHandle.longest_pause_s, now_s - self._looked_s)
        self._looked_s = now_s
        if timeout_ms == 0 and now_s - self._reported_s < _REPORT_PERIOD_S:
            return []
        self._reported_s = now_s
        return self._report[:max_length]

    def write(self, data: bytes) -> int:
        """Note it."""
        self._stamps.append((self._clock.now(), data))
        return len(data)

    def get_feature_report(self, report_num: int, max_length: int) -> list[int]:
        """It tells nothing of itself."""
        raise OSError(f"feature {report_num} of {max_length} bytes is not there")

    def close(self) -> None:
        """There is nothing to close."""

    def error(self) -> str:
        """Nothing fails."""
        return ""


class StampingBackend:
    """hidapi with one controller."""

    def __init__(self, transport: Transport) -> None:
        self.stamps: Stamps = []
        self._transport = transport

    def enumerate(self, vendor_id: int, product_id: int) -> list[dict[str, Any]]:
        """One DualSense."""
        return [{"path": os.fsencode(os.devnull)}] if (vendor_id, product_id) == (0x054C, 0x0CE6) else []

    def device(self) -> HidHandle:
        """The handle on it."""
        return StampingHandle(self._transport, self.stamps)


def measure(settings: EffectLatencySettings) -> Outcome:
    """Run both ends; FeelaheadError when the operator side does not appear or report."""
    count = 50 if settings.quick else settings.changes
    transport = Transport.USB if settings.transport == "usb" else Transport.BLUETOOTH
    generator = np.random.default_rng(settings.seed)
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    with StiffnessSource() as source, Progress(transient=True) as progress:
        flags = [f"--connect={source.address}", f"--view-connect={source.view_address}", "--status=none"]
        operator = context.Process(
            target=_operator_process,
            args=([*flags, "--realtime"] if settings.realtime else flags, transport, there),
            daemon=True,
        )
        operator.start()
        try:
            _wait_for(source)
            source.run(_REST_S)
            rest_from_s, rest_to_s = source.sent_s - _REST_S / 2, source.sent_s
            bar = progress.add_task("changes", total=count)
            changed_s = []
            for number in range(count):
                source.state = "disarmed" if number % 2 == 0 else "armed"
                changed_s.append(source.change())
                source.run(float(generator.uniform(_SHORTEST_HOLD_S, _LONGEST_HOLD_S)))
                progress.advance(bar)
            end_s = source.sent_s
            operator.terminate()
            if not here.poll(_PATIENCE_S):
                raise FeelaheadError(f"the operator side did not report within {_PATIENCE_S:g} s")
            stamps: Stamps
            stamps, pause_s = here.recv()
        finally:
            operator.terminate()
            operator.join(_PATIENCE_S)
    written_s = np.array([at_s for at_s, _ in stamps])
    return Outcome(
        latencies_s=first_writes(np.array(changed_s), written_s, end_s),
        writes=int(np.sum((written_s >= changed_s[0]) & (written_s <= end_s))),
        writes_at_rest=int(np.sum((written_s >= rest_from_s) & (written_s <= rest_to_s))),
        rest_s=rest_to_s - rest_from_s,
        longest_pause_s=max(pause_s, source.longest_pause_s),
    )


def bench_effects(arguments: Sequence[str]) -> int:
    """Measure and print; exit code 1 when the goal is missed."""
    settings = parse_settings(EffectLatencySettings, PROGRAM, arguments)
    outcome = measure(settings)
    latencies_ms = 1e3 * outcome.latencies_s
    lost = int(np.sum(np.isnan(latencies_ms)))
    p50, p99, longest = np.nanquantile(latencies_ms, (0.5, 0.99, 1.0))
    met = p99 < GOAL_P99_MS and lost == 0 and outcome.writes_at_rest == 0
    table = Table(title=_title(settings))
    for heading in ("changes", "p50, ms", "p99, ms", "max, ms", "not written", "writes a change", "writes/s at rest"):
        table.add_column(heading, justify="right")
    table.add_row(
        str(len(latencies_ms)),
        f"{p50:.2f}",
        f"{p99:.2f}",
        f"{longest:.2f}",
        str(lost),
        f"{outcome.writes / len(latencies_ms):.2f}",
        f"{outcome.writes_at_rest / outcome.rest_s:.1f}",
    )
    console = Console(width=None if sys.stdout.isatty() else 110)
    console.print(table)
    console.print(f"goal: p99 below {GOAL_P99_MS:g} ms, all written, none at rest: {'met' if met else 'missed'}")
    return 0 if met else 1


def _wait_for(source: StiffnessSource) -> None:
    """Until the operator side is there and its controller, too, which its commands show."""
    source.r2 = _STRENGTH
    for _ in range(round(_PATIENCE_S / 0.1)):
        source.run(0.1)
        if source.commands > 0:
            return
    raise FeelaheadError(f"the operator side did not appear within {_PATIENCE_S:g} s")


def first_writes(changed_s: np.ndarray, written_s: np.ndarray, end_s: float) -> np.ndarray:
    """(n,) from each change to the first write before the next change."""
    until_s = np.append(changed_s[1:], end_s)
    following = np.searchsorted(written_s, changed_s)
    first_s = np.append(written_s, np.inf)[following]
    return np.where(first_s < until_s, first_s - changed_s, np.nan)


def _operator_process(arguments: list[str], transport: Transport, pipe: Connection) -> None:
    backend = StampingBackend(transport)
    operator_command(arguments, backend)
    pipe.send((backend.stamps, StampingHandle.longest_pause_s))


def _title(settings: EffectLatencySettings) -> str:
    how = f"{settings.transport}{', --realtime' if settings.realtime else ''}"
    return f"stiffness change to HID write ({how}), {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}"
