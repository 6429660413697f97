"""Tests of the command `feelahead virtual-dualsense`, run as a separate process."""

import signal
import subprocess
import sys
from pathlib import Path

from operator_side.controller.feel import Feel
from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.reports.output_report import build_output_report
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.controller import SIMULATED_ADDRESS
from operator_side.dualsense.uhid.controller import UhidIdentity
from tests.helpers.machines.waiting import LIMIT_S, wait_until
from tests.helpers.messages import feedback
from tests.kernel.inside.kernel_view import ABS_RZ, ABS_X, InputDevice, seen_device

# Not all of `feelahead`: an emulated processor would take long to load the other commands.
_COMMAND = (
    "import sys; from feelahead.commands.virtual_dualsense import virtual_dualsense as v; sys.exit(v(sys.argv[1:]))"
)


def test_the_driver_takes_it_its_hands_move_and_it_says_what_it_is_told(tmp_path: Path) -> None:
    transport = Transport.BLUETOOTH
    commanded = UhidIdentity(transport, Model.DUALSENSE, SIMULATED_ADDRESS)
    command = [sys.executable, "-P", "-c", _COMMAND, "--transport", transport.value.lower(), "--hands", "pulling"]
    said = tmp_path / "said"

    def lines() -> list[str]:
        return said.read_text().splitlines()

    with said.open("w") as output, subprocess.Popen(command, stdout=output, stderr=output) as process:
        try:
            wait_until("a driver takes it", lambda: "a driver has taken it" in lines(), instead=lines)
            view = wait_until("the kernel shows it", lambda: seen_device(commanded))
            wait_until("three input devices", lambda: len(view.inputs()) == 3)
            with InputDevice(view.inputs()[commanded.name]) as device:
                wait_until("R2 is pulled", lambda: device.axes(ABS_RZ)[0] > 200)
                wait_until("R2 is free, and the stick is left", lambda: device.axes(ABS_RZ)[0] == 0 and _left(device))
            hidraw = view.hidraw()
            assert hidraw is not None
            hidraw.write_bytes(build_output_report(Feel(r2=feedback(position=3, strength=6)), transport))
            told_it = "R2: strengths 0 0 0 6 6 6 6 6 6 6"
            wait_until("it says the effect", lambda: told_it in lines(), instead=lines)
            process.send_signal(signal.SIGTERM)
            assert process.wait(LIMIT_S) == 0
            assert lines()[-1].startswith("unplugged: ")
            wait_until("it is gone", lambda: seen_device(commanded) is None)
        finally:
            process.kill()


def _left(device: InputDevice) -> bool:
    return device.axes(ABS_X)[0] < 100
