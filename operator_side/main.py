"""The process `feelahead-operator`: sockets, clock, controller, core; nothing else."""

import json
import secrets
from collections.abc import Sequence

from common.clock import MonotonicClock, clock_domain
from common.command_line import parse_settings, run_command
from common.errors import FeelaheadError
from common.link_model import DelayLine, link_summary, unused_clauses
from common.priority import raise_priority
from common.sockets import OperatorSockets
from common.status import Status
from common.stop_signal import StopSignal, ignore_broken_output
from operator_side.core import OperatorSide
from operator_side.dualsense.device import HidDualSense
from operator_side.dualsense.port import Device
from operator_side.dualsense.simulated import SimulatedDualSense
from operator_side.settings import OperatorSettings
from operator_side.simulated_operator import SimulatedOperator

MOTION_PERIOD_S = 1 / 250


def main() -> None:
    """The console script."""
    run_command("feelahead-operator", command)


def command(arguments: Sequence[str]) -> int:
    """Run the operator side until --duration, Ctrl-C or SIGTERM; the triggers are released on every way out."""
    settings = parse_settings(OperatorSettings, "feelahead-operator", arguments)
    link = settings.link_spec()
    core = OperatorSide(
        secrets.randbits(53),
        clock_domain(),
        haptics=settings.haptics,
        calibration=settings.calibration,
        seed=settings.seed,
    )
    line: DelayLine[bytes] = DelayLine(link.profile("to_robot"))
    with (
        OperatorSockets(settings.connect, settings.view_connect) as sockets,
        StopSignal() as stop,
        Status(settings.status, "operator") as status,
    ):
        for text in unused_clauses(link, [("to_robot", "haptics")]):
            status.note(text)
        device: Device
        person: SimulatedOperator | None = None
        if settings.device == "simulated":
            device = simulated = SimulatedDualSense()
            person = SimulatedOperator(simulated, settings.person, settings.seed, settings.calibration)
        else:
            device = HidDualSense()
        raise_priority()
        failure: FeelaheadError | None = None
        try:
            _loop(settings, core, line, sockets, device, person, stop, status)
        except BrokenPipeError:
            ignore_broken_output()
        except FeelaheadError as error:
            failure = error
        finally:
            device.close()
        # A real controller cannot be asked, but closing it raises when the release cannot be written.
        released = device.released if isinstance(device, SimulatedDualSense) else True
        errors = [] if failure is None else [str(failure)]
        summary = core.summary() | {"triggers_released": released, "errors": errors}
        summary["link"] = link_summary("to_robot", {"haptics": line})
        if settings.summary is not None:
            settings.summary.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
        if failure is not None:
            raise failure
    return 0


def _loop(
    settings: OperatorSettings,
    core: OperatorSide,
    line: DelayLine[bytes],
    sockets: OperatorSockets,
    device: Device,
    person: SimulatedOperator | None,
    stop: StopSignal,
    status: Status,
) -> None:
    clock = MonotonicClock()
    start_s = next_motion_s = clock.now()
    while not stop.is_set:
        now_s = clock.now()
        if settings.duration is not None and now_s - start_s >= settings.duration:
            break
        for payload in sockets.receive():
            core.receive(payload, now_s)
        for _, payload in sockets.receive_view():
            core.receive_view(payload, now_s)
        if (output := core.output_report(now_s)) is not None:
            device.write(output, now_s)
        if now_s >= next_motion_s:
            # A late loop skips what it missed: the newest motion is all that counts.
            next_motion_s = max(next_motion_s + MOTION_PERIOD_S, now_s)
            if person is not None:
                person.tick(now_s, core.screen, core.link.round_trip.mean or 0.0)
            if (report := device.read(now_s)) is not None:
                core.read_report(report, now_s)
            for payload in core.motion(now_s):
                line.push(now_s, payload)
            if status.due(now_s):
                status.show(now_s, core.status(now_s) | ({"person": person.phase} if person else {}))
        for payload in line.pop(clock.now()):
            sockets.send(payload)
        due_s = line.next_due()
        wake_s = next_motion_s if due_s is None else min(next_motion_s, due_s)
        sockets.wait(max(0.0, wake_s - clock.now()))


if __name__ == "__main__":
    main()
