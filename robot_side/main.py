"""The process `feelahead-robot`: sockets, clock, core; nothing else."""

import dataclasses
import json
import secrets
import time
from collections.abc import Mapping, Sequence

from common.clock import MonotonicClock, clock_domain
from common.command_line import parse_settings, run_command
from common.errors import FeelaheadError
from common.link_model import BitFlip, DelayLine, Stream, link_summary, unused_clauses
from common.priority import raise_priority
from common.sockets import RobotSockets
from common.statistics import RunningStatistics
from common.status import Status
from common.stop_signal import StopSignal, ignore_broken_output
from robot_side.assembly import build_robot_side
from robot_side.core import Outgoing, RobotSide
from robot_side.overlap.kernels import warm_up
from robot_side.run_figures import tick_microseconds
from robot_side.settings import RobotSettings

TICK_PERIOD_S = 1e-3
SENT_STREAMS: tuple[Stream, ...] = ("haptics", "telemetry")


def main() -> None:
    """The console script."""
    run_command("feelahead-robot", command)


def command(arguments: Sequence[str]) -> int:
    """Run the robot side until --duration, Ctrl-C or SIGTERM; the arm stands still on every way out."""
    settings = parse_settings(RobotSettings, "feelahead-robot", arguments)
    link = settings.link_spec()
    lines: dict[Stream, DelayLine[Outgoing]] = {
        stream: DelayLine(link.profile("to_operator", stream), corrupt=_corrupted) for stream in SENT_STREAMS
    }
    # The sockets first: a port that is taken is found out before the kernels are compiled.
    with (
        RobotSockets(settings.bind, settings.view_bind, insecure=settings.insecure) as sockets,
        StopSignal() as stop,
        Status(settings.status, "robot") as status,
    ):
        core = build_robot_side(settings, secrets.randbits(53), clock_domain())
        for text in (*core.notes, *unused_clauses(link, [("to_operator", stream) for stream in SENT_STREAMS])):
            status.note(text)
        warm_up(lambda: status.note("compiling the overlap kernels, up to a minute; the next start is quick"))
        status.note(f"listening at {sockets.control_endpoint}, view at {sockets.view_endpoint}")
        status.event("listening", control=sockets.control_endpoint, view=sockets.view_endpoint)
        raise_priority()
        tick_time = RunningStatistics(settings.seed)
        clock = MonotonicClock()
        start_s = clock.now()
        failure: FeelaheadError | None = None
        try:
            _loop(settings, core, lines, sockets, stop, status, tick_time)
        except BrokenPipeError:
            ignore_broken_output()
        except FeelaheadError as error:
            failure = error
        summary = {"duration_s": clock.now() - start_s, "tick_us": tick_microseconds(tick_time)} | core.summary()
        summary["link"] = link_summary("to_operator", lines)
        # A run that failed has figures, too.
        summary["errors"] = [] if failure is None else [str(failure)]
        if settings.summary is not None:
            settings.summary.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
        if failure is not None:
            raise failure
    return 0


def _corrupted(message: Outgoing, flip: BitFlip) -> Outgoing:
    return dataclasses.replace(message, payload=flip(message.payload))


def _loop(
    settings: RobotSettings,
    core: RobotSide,
    lines: Mapping[Stream, DelayLine[Outgoing]],
    sockets: RobotSockets,
    stop: StopSignal,
    status: Status,
    tick_time: RunningStatistics,
) -> None:
    clock = MonotonicClock()
    start_s = next_tick_s = clock.now()
    while not stop.is_set:
        now_s = clock.now()
        if settings.duration is not None and now_s - start_s >= settings.duration:
            break
        for peer, payload in sockets.receive():
            core.receive(peer, payload, now_s)
        if now_s >= next_tick_s:
            # A late loop skips the ticks that it missed: the newest state is all that counts.
            next_tick_s = max(next_tick_s + TICK_PERIOD_S, now_s)
            began_s = time.perf_counter()
            outgoing = core.tick(now_s)
            tick_time.add(time.perf_counter() - began_s)
            for message in outgoing:
                lines[message.stream].push(now_s, message, len(message.payload))
            if status.due(now_s):
                status.show(now_s, core.status(now_s))
        due_s = clock.now()
        for line in lines.values():
            for message in line.pop(due_s):
                if message.stream == "haptics":
                    sockets.send(message.peer, message.payload)
                else:
                    sockets.publish(b"telemetry", message.payload)
        wakes_s = [next_tick_s, *(due for line in lines.values() if (due := line.next_due()) is not None)]
        sockets.wait(max(0.0, min(wakes_s) - clock.now()))


if __name__ == "__main__":
    main()
