"""A simulated controller carried by either transport, with the answers to the driver's questions."""

import dataclasses

from operator_side.dualsense.controller_state import AT_REST_M_S2, Vector3
from operator_side.dualsense.feature_report import CalibrationReport, Firmware, build_address
from operator_side.dualsense.input_report import build_input_report, parse_input_report
from operator_side.dualsense.motion_sensors import MotionCalibration
from operator_side.dualsense.output_report import build_output_report, parse_output_report
from operator_side.dualsense.simulated import SimulatedDualSense
from operator_side.dualsense.transport import Transport

ADDRESS = "06:05:04:03:02:01"
FIRMWARE = Firmware(hardware_version=0x0617, firmware_version=0x01000005, update_version=0x0300)
"""New enough for the driver to rumble in the second way."""
_CALIBRATION = CalibrationReport(
    gyro_bias=(0, 0, 0),
    gyro_plus=(8843, 8850, 8870),
    gyro_minus=(-8837, -8860, -8866),
    speed_plus=540,
    speed_minus=540,
    acceleration_plus=(8250, 8200, 8100),
    acceleration_minus=(-8130, -8190, -8240),
)
"""As unlike for each axis as real ones are, but for the gyroscope's bias: Linux 6.1 takes it off, later ones do not."""
MOTION = MotionCalibration.of(_CALIBRATION)


class Carried:
    """What is offered to the kernel of `simulated`, whose own reports are those of USB."""

    def __init__(self, simulated: SimulatedDualSense, transport: Transport) -> None:
        self._simulated = simulated
        self._transport = transport
        self.turning_rad_s: Vector3 = (0.0, 0.0, 0.0)
        self.acceleration_m_s2: Vector3 = AT_REST_M_S2
        self._features = {
            0x05: _CALIBRATION.build(transport),
            0x09: build_address(ADDRESS, transport),
            0x20: FIRMWARE.build(transport),
        }

    def read(self, now_s: float) -> bytes | None:
        """The newest report as the transport carries it."""
        report = self._simulated.read(now_s)
        if report is None:
            return None
        state = dataclasses.replace(
            parse_input_report(report), gyro_rad_s=self.turning_rad_s, acceleration_m_s2=self.acceleration_m_s2
        )
        return build_input_report(state, self._transport, MOTION)

    def write(self, report: bytes, now_s: float) -> None:
        """Take an output report; ValueError for one that cannot be read."""
        self._simulated.write(build_output_report(parse_output_report(report)), now_s)

    def get_feature(self, report_id: int) -> bytes:
        """The calibration, the address or the firmware; ValueError for others."""
        if report_id not in self._features:
            raise ValueError(f"report_id = 0x{report_id:02x}; valid: 0x05, 0x09, 0x20")
        return self._features[report_id]
