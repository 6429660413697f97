"""Rows of the tables that are made from a recording's inputs; other tables have the rows of their topics."""

import msgspec

from operator_side.viewing.facts import Ten


class ArmRow(msgspec.Struct, frozen=True):
    """State of the arm, as its sensors measure it."""

    position_rad: tuple[float, ...]
    """Encoder reading of each joint, in the joint frame; metres for a prismatic joint"""
    velocity_rad_s: tuple[float, ...]
    """Velocity of each joint, in the joint frame, as its drive estimates it; m/s for a prismatic joint"""
    gripper_opening_m: float
    """Free gap between the fingers, along the jaws' motion; 0 without a gripper"""
    gripper_holding: bool
    """Whether an object between the fingers stopped them while they were commanded to close"""


class ControllerRow(msgspec.Struct, frozen=True):
    """State of the controller's triggers."""

    l2_raw: float
    """Raw travel of L2 as the controller measures it, 0 to 1"""
    r2_raw: float
    """Raw travel of R2 as the controller measures it, 0 to 1"""
    l2_meets: int
    """Strength of L2's zone at the present travel, 0 to 8: what the finger feels now"""
    r2_meets: int
    """Strength of R2's zone at the present travel, 0 to 8: what the finger feels now"""


class FeltRow(msgspec.Struct, frozen=True):
    """Strengths as written to the controller."""

    l2: Ten
    """Strength of each of L2's ten zones, from the released trigger on, 0 to 8 (§4.2)"""
    r2: Ten
    """Strength of each of R2's ten zones, from the released trigger on, 0 to 8 (§4.2)"""
