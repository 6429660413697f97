"""The command `feelahead virtual-dualsense`, as a process of its own."""

import signal
import subprocess
import sys
import threading

from operator_side.dualsense.reports.output_report import OutputReport, build_output_report
from operator_side.dualsense.simulated.controller import SIMULATED_ADDRESS
from operator_side.dualsense.uhid.controller import identity
from tests.helpers.felt import feedback
from tests.kernel.evdev import ABS_RZ, ABS_X, InputDevice
from tests.kernel.kernel_view import seen_device
from tests.kernel.plugged import Variant
from tests.kernel.waiting import require, wait_until

_START_S = 60.0
# Not all of `feelahead`, whose other commands an emulated processor would load for long.
_COMMAND = (
    "import sys; from feelahead.commands.virtual_dualsense import virtual_dualsense as v; sys.exit(v(sys.argv[1:]))"
)


def lives(variant: Variant) -> str:
    """feelahead virtual-dualsense: the driver takes it, its hands move, and it says what it is told."""
    transport = variant.transport
    told = identity(transport, variant.model, SIMULATED_ADDRESS)
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", _COMMAND, "--transport", transport.value.lower(), "--hands", "pulling"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    lines: list[str] = []
    assert process.stdout is not None
    reader = threading.Thread(target=lambda stream=process.stdout: lines.extend(iter(stream.readline, "")), daemon=True)
    reader.start()
    try:
        wait_until("a driver takes it", lambda: "a driver has taken it\n" in lines, _START_S, instead=lambda: lines)
        view = wait_until("the kernel shows it", lambda: seen_device(told))
        wait_until("three input devices", lambda: len(view.inputs()) == 3)
        with InputDevice(view.inputs()[told.name]) as device:
            wait_until("R2 is pulled", lambda: device.axis(ABS_RZ).value > 200)
            wait_until("R2 is free, and the stick is left", lambda: device.axes(ABS_RZ)[0] == 0 and _left(device))
        hidraw = view.hidraw()
        assert hidraw is not None
        hidraw.write_bytes(build_output_report(OutputReport(r2=feedback(position=3, strength=6)), transport))
        said = "R2: strengths 0 0 0 6 6 6 6 6 6 6\n"
        wait_until("it says the effect", lambda: said in lines, instead=lambda: lines)
        process.send_signal(signal.SIGTERM)
        code = process.wait(30.0)
        reader.join(10.0)
        require(code == 0, f"it ended with code {code}: {lines}")
        require(lines[-1].startswith("unplugged: "), f"it says last: {lines[-1]}")
        wait_until("it is gone", lambda: seen_device(told) is None)
    finally:
        process.kill()
        process.wait()
    return lines[-1].strip()


def _left(device: InputDevice) -> bool:
    return device.axis(ABS_X).value < 100
