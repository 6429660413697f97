"""Choices of the driver while driving: the speed scale, and the frame of the sticks."""

import math
from dataclasses import replace
from typing import Annotated, Final, Literal, get_args

from msgspec import Meta

from common.limits import check_value
from common.protocol.messages import Telemetry
from operator_side.controller.state import Stick
from operator_side.hands.intent import OperatorIntent

SpeedScale = Annotated[float, Meta(ge=0.05, le=1.0)]
StickFrame = Literal["tool", "base", "camera"]
_SCALES: Final = (0.5, 0.25)
_FRAMES: Final[tuple[StickFrame, ...]] = get_args(StickFrame)
_OLD_S: Final = 1.0
"""Age of the telemetry in seconds, ten times its longest period, from which frames but the tool's are unknown"""


class Choices:
    """Present choices. A press takes effect once triggers and sticks are at rest, so that nothing moves by surprise.

    Both change what is commanded before it is sent, on the operator side alone: the scale multiplies triggers and
    sticks, and the frame turns the sticks in their plane. So the commands under way and all that is felt follow them.
    """

    def __init__(self, speed_scale: float = 1.0, stick_frame: StickFrame = "tool") -> None:
        check_value("speed_scale", speed_scale, SpeedScale)
        self.speed_scale = self._next_scale = speed_scale
        """Share of the full speed that full travel and full deflection command"""
        self.stick_frame = self._next_frame = stick_frame
        self._pressed = False, False
        self._screen: Telemetry | None = None
        self._seen_s = -math.inf
        self._mirrored = False
        self._camera_turn_rad: float | None = None
        """Newest angle that was computed for the same side of the camera as `_mirrored` says"""

    def read(self, intent: OperatorIntent) -> None:
        """Take the buttons of the newest intent."""
        speed, frame = self._pressed
        if intent.next_speed and not speed:
            self._next_scale = next((scale for scale in _SCALES if scale < self._next_scale), 1.0)
        if intent.next_frame and not frame:
            self._next_frame = _FRAMES[(_FRAMES.index(self._next_frame) + 1) % len(_FRAMES)]
        self._pressed = intent.next_speed, intent.next_frame
        if intent.rests:
            self.speed_scale, self.stick_frame = self._next_scale, self._next_frame
            self._mirrored = self._screen is not None and self._screen.camera_faces
            self._aim()

    def see(self, screen: Telemetry, now_s: float) -> None:
        """Take the newest telemetry, which has the frames' angles at the moment that its pictures show."""
        self._screen, self._seen_s = screen, now_s
        self._aim()

    def _aim(self) -> None:
        # Where the tool turns to face the camera, the angle for the other side may be half a turn away.
        if self._screen is not None and self._screen.camera_faces == self._mirrored:
            self._camera_turn_rad = self._screen.camera_turn_rad

    def commanded(self, intent: OperatorIntent, now_s: float) -> OperatorIntent:
        """Return the intent to send. Sticks in a frame that is unknown at present count as at rest."""
        scaled = intent if self.speed_scale == 1.0 else intent.scaled(self.speed_scale)
        if self.stick_frame == "tool" or scaled.lateral == scaled.turning == (0.0, 0.0):
            return scaled
        of_camera = self.stick_frame == "camera"
        base_rad = None if self._screen is None else self._screen.base_turn_rad
        turn_rad = self._camera_turn_rad if of_camera else base_rad
        if turn_rad is None or now_s - self._seen_s > _OLD_S:
            return replace(scaled, lateral=(0.0, 0.0), turning=(0.0, 0.0))
        mirrored = of_camera and self._mirrored
        return replace(
            scaled,
            lateral=_turned(scaled.lateral, turn_rad, mirrored=mirrored),
            turning=_turned(scaled.turning, turn_rad, mirrored=mirrored),
        )


def _turned(stick: Stick, turn_rad: float, *, mirrored: bool) -> Stick:
    """Turn a deflection counterclockwise; mirrored: first exchange up and down."""
    right, up = stick
    cosine, sine = math.cos(turn_rad), math.sin(turn_rad)
    up = -up if mirrored else up
    x, y = cosine * right - sine * up, sine * right + cosine * up
    return (min(max(x, -1.0), 1.0), min(max(y, -1.0), 1.0))
