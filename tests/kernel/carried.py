"""A simulated controller carried by either transport, with the answers to the driver's questions."""

from operator_side.dualsense.feature_report import CalibrationReport, Firmware, build_address
from operator_side.dualsense.input_report import build_input_report, parse_input_report
from operator_side.dualsense.output_report import build_output_report, parse_output_report
from operator_side.dualsense.simulated import SimulatedDualSense
from operator_side.dualsense.transport import Transport

_CALIBRATION = CalibrationReport(
    gyro_bias=(0, 0, 0),
    gyro_plus=(8640, 8640, 8640),
    gyro_minus=(-8640, -8640, -8640),
    speed_plus=540,
    speed_minus=540,
    acceleration_plus=(8192, 8192, 8192),
    acceleration_minus=(-8192, -8192, -8192),
)


class Carried:
    """What is offered to the kernel of `simulated`, whose own reports are those of USB."""

    def __init__(self, simulated: SimulatedDualSense, transport: Transport) -> None:
        self._simulated = simulated
        self._transport = transport
        self._features = {
            0x05: _CALIBRATION.build(transport),
            0x09: build_address("06:05:04:03:02:01", transport),
            0x20: Firmware(1, 2, 3).build(transport),
        }

    def read(self, now_s: float) -> bytes | None:
        """The newest report as the transport carries it."""
        report = self._simulated.read(now_s)
        if report is None or self._transport is Transport.USB:
            return report
        return build_input_report(parse_input_report(report), self._transport)

    def write(self, report: bytes, now_s: float) -> None:
        """Take an output report; ValueError for one that cannot be read."""
        self._simulated.write(build_output_report(parse_output_report(report)), now_s)

    def get_feature(self, report_id: int) -> bytes:
        """The calibration, the address or the firmware; ValueError for others."""
        if report_id not in self._features:
            raise ValueError(f"report_id = 0x{report_id:02x}; valid: 0x05, 0x09, 0x20")
        return self._features[report_id]
