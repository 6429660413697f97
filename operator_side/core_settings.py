"""Settings of the operator side's core."""

from dataclasses import dataclass, field

from common.periods import TURN_S
from common.protocol.messages import Compensation
from operator_side.feel.rendering import RenderingSettings
from operator_side.hands.choices import StickFrame
from operator_side.hands.travel_calibration import TravelCalibration


@dataclass(frozen=True, kw_only=True)
class CoreSettings:
    """Settings of the core: rendering and commands."""

    haptics: bool = True
    """Whether the triggers resist and the motors rumble"""
    calibration: TravelCalibration = field(default_factory=TravelCalibration)
    rendering: RenderingSettings = field(default_factory=RenderingSettings)
    compensation: Compensation = "operator"
    speed_scale: float = 1.0
    """Share of the full speed that full travel and full deflection command at first"""
    stick_frame: StickFrame = "tool"
    """Frame in which the sticks move and turn the tool at first"""
    fixed_task: bool = False
    """Whether marks of episodes, resets and other targets are refused"""
    swap_sides: bool = False
    """Whether left and right are exchanged: triggers, sticks and hold-to-run"""
    seed: int = 0
    asymmetry_s: float = 0.0
    """Minimum delay to the robot side minus minimum delay to the operator side, in seconds, if known"""
    tick_period_s: float = TURN_S
    full_rate: bool = False
    """Whether to send a command in every turn of the loop, without waiting for changes"""
