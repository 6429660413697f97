"""Checklist before the first motion of an arm by an operator: what `feelahead doctor --arm` goes through."""

import math
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple, Protocol

import numpy as np

from robot_side.arm.stick_frames import Frame
from robot_side.commissioning.arm_alone import ArmAlone
from robot_side.commissioning.joint_checks import (
    NUDGE_RAD,
    Heard,
    Nudged,
    drive_gripper,
    listen,
    motion_in_words,
    nudge,
    place_in_words,
)
from robot_side.commissioning.procedure import SLIDE_M_PER_RAD, Procedure, Result, Watch, carry_out
from robot_side.drivers.mujoco.viewpoints import stick_frames
from robot_side.settings import RobotSettings

_LEAST_STATES_PER_S: Final = 30.0
_OLD_S: Final = 0.05
_WITHIN: Final = 0.3
"""Share of the asked motion by which a joint may miss it"""
_OTHERS_RAD: Final = 0.5 * NUDGE_RAD
_BLOCK_M: Final = 0.002
_HEAVY: Final = 0.5
_LIMITS: Final = (("speed", "velocity_rad_s"), ("acceleration", "acceleration_rad_s2"), ("latency", "latency_s"))
_MEASURE: Final = "feelahead-robot --measure-limits"


class Check(NamedTuple):
    """Outcome of one check."""

    name: str
    good: bool | None
    """None: worth a note, but nothing is wrong"""
    said: str
    remedy: str | None = None


Ask = Callable[[str], bool]
"""Asks a person; returns whether the answer is yes"""


class Carry(Protocol):
    """Function that carries a procedure out."""

    def __call__(self, procedure: Procedure[Result]) -> Result:
        """Return the procedure's result."""
        ...


def run_checks(one: ArmAlone, ask: Ask, block_m: float | None) -> Iterator[Check]:
    """Go through the list; each check is yielded when it is done.

    block_m: width of a block to close the gripper on; None leaves this out. ProcedureError as `carry_out` raises it.
    """
    watch = Watch(one.known.limits, one.joint_names, one.settings.safety.arm_s)

    def carry(procedure: Procedure[Result]) -> Result:
        return carry_out(procedure, one.arm, one.pace, watch)

    heard = carry(listen(one.arm.joint_count))
    yield from _states(one, heard)
    yield _limits(one)
    yield _loads(one, heard)
    yield from _bounds(one.settings)
    base = stick_frames(one.parts.scene).base
    yield _place(one, heard, ask, base)
    for joint, name in enumerate(one.joint_names):
        there = carry(nudge(joint, one.known.limits))
        yield _joint(one, joint, f"joint {joint + 1} ({name})", there, ask, base)
        carry(nudge(joint, one.known.limits, back_from=there))
    yield from _gripper(one, carry, ask, block_m)


def _states(one: ArmAlone, heard: Heard) -> Iterator[Check]:
    quick = heard.states_per_s >= _LEAST_STATES_PER_S
    said = f"{heard.states_per_s:.0f} a second"
    yield Check("states", quick, said, None if quick else f"send {_LEAST_STATES_PER_S:.0f} a second or more")
    young = heard.oldest_s <= _OLD_S
    yield Check(
        "age of states",
        True if young else None,
        f"up to {1e3 * heard.oldest_s:.0f} ms; the arm is lost from {1e3 * one.settings.safety.arm_s:.0f} ms on",
        None if young else "send states more often, with the time at which they were measured",
    )
    worst = int(heard.noise_rad.argmax())
    assumed = math.hypot(one.settings.encoder.sigma_rad, one.settings.encoder.resolution_rad / math.sqrt(12.0))
    quiet = heard.noise_rad[worst] <= 1.5 * assumed
    yield Check(
        "noise of readings",
        True if quiet else None,
        f"up to {1e3 * heard.noise_rad[worst]:.2f} mrad ({one.joint_names[worst]}); {1e3 * assumed:.2g} are assumed",
        None if quiet else f"--encoder.sigma-rad {heard.noise_rad[worst]:.1e}",
    )


def _limits(one: ArmAlone) -> Check:
    sources = {
        what: one.known.source(name)
        for what, name in (
            ("speed", "velocity_rad_s"),
            ("acceleration", "acceleration_rad_s2"),
            ("latency", "latency_s"),
        )
    }
    said = ", ".join(f"{what}: {source}" for what, source in sources.items())
    known = "assumed" not in sources.values()
    return Check("limits", True if known else None, said, None if known else _MEASURE)


def _bounds(settings: RobotSettings) -> Iterator[Check]:
    box, kept_out, cap_m_s = settings.arm_workspace, settings.arm_keep_out, settings.arm_fastest_m_s
    around = ", ".join(str(one.center_m) for one in kept_out)
    for name, key, said in (
        ("workspace box", "workspace", box and f"from {box.lower_m} m to {box.upper_m} m in the world"),
        ("keep-out boxes", "keep_out", around and f"around {around} m in the world"),
        ("speed cap", "fastest_m_s", cap_m_s and f"{cap_m_s:g} m/s"),
    ):
        yield Check(name, True, said) if said else Check(name, None, "not set", f"[arm] {key} in --config")


def _loads(one: ArmAlone, heard: Heard) -> Check:
    if heard.loads_nm is None:
        return Check("loads at rest", None, "the driver sends none: nothing stops a joint that presses", "joint_loads")
    limits = one.known.limits.load_nm
    shown = ", ".join(f"{load:.1f}" for load in heard.loads_nm)
    if not np.isfinite(limits).any():
        return Check("loads at rest", None, f"{shown} N m; no limit is set", "[arm.limits] load_nm in --config")
    heavy = bool((np.abs(heard.loads_nm) > _HEAVY * limits).any())
    remedy = "set the tool's weight in the arm's own controller, or a greater load_nm" if heavy else None
    return Check("loads at rest", not heavy, f"{shown} N m", remedy)


def _place(one: ArmAlone, heard: Heard, ask: Ask, base: Frame) -> Check:
    tool_m = one.parts.kinematics.pose(heard.state).tool_position_m
    degrees = ", ".join(f"{math.degrees(angle):.0f}" for angle in heard.state.joint_positions_rad)
    said = f"by the joints ({degrees}) the tool is {place_in_words(tool_m, base)} of the world's origin"
    right = ask(f"{said}. Is it there, within 1 cm?")
    return Check("zero offsets", right, said, None if right else "the driver's zero offsets, or --model")


def _joint(one: ArmAlone, joint: int, name: str, there: Nudged, ask: Ask, base: Frame) -> Check:
    """Judge a joint's small motion by the measured positions, then let a person judge the real one."""
    slides = np.broadcast_to(one.known.limits.slides, len(one.joint_names))
    scales = np.where(slides, SLIDE_M_PER_RAD, 1.0)
    moved = float(there.moved_rad[joint])
    shown = f"{1e3 * moved:.1f} mm" if slides[joint] else f"{math.degrees(moved):.1f}°"
    others = np.abs(there.moved_rad) / scales
    others[joint] = 0.0
    worst = int(others.argmax())
    if others[worst] > _OTHERS_RAD:
        said = f"joint {worst + 1} ({one.joint_names[worst]}) moved with it, or instead"
        return Check(name, False, said, "the order of the joints in the driver")
    if abs(moved - there.asked_rad) > _WITHIN * abs(there.asked_rad):
        turned = moved * there.asked_rad < 0.0 and abs(moved) > _WITHIN * abs(there.asked_rad)
        return Check(
            name,
            False,
            f"its reading moved by {shown}{', the other way' if turned else ''}",
            "the joint's sign in the driver" if turned else "the driver: does it take commands, and is the drive on?",
        )
    # A pose's arrays belong to it, so both can be compared.
    poses = [one.parts.kinematics.pose(state) for state in (there.before, there.after)]
    words = motion_in_words(poses[0], poses[1], base)
    right = ask(f"{name} moved by {shown}: {words}. Is that what you saw?")
    remedy = None if right else "the joint's sign, order or zero offset in the driver, or another --model"
    return Check(name, right, f"moved by {shown}: {words}", remedy)


def _gripper(one: ArmAlone, carry: Carry, ask: Ask, block_m: float | None) -> Iterator[Check]:
    if one.parts.kinematics.has_fingers is False:
        return
    if block_m is None:
        yield Check("gripper", None, "not closed on anything", "a block of known width, and its --block-mm")
        return
    joints = one.arm.joint_count
    wide = carry(drive_gripper(joints, closes=False)).gripper_opening_m
    if not ask(f"Hold the block of {1e3 * block_m:.1f} mm between the fingers; they close slowly. Is it there?"):
        yield Check("gripper", None, "not closed on anything", "--block-mm, with a block between the fingers")
        return
    closed = carry(drive_gripper(joints, closes=True))
    off_m = closed.gripper_opening_m - block_m
    right = abs(off_m) <= _BLOCK_M
    yield Check(
        "gripper",
        right,
        f"{1e3 * closed.gripper_opening_m:.1f} mm on the block of {1e3 * block_m:.1f} mm, {1e3 * wide:.1f} mm open",
        None if right else "opening_m of the driver's states",
    )
    if not closed.gripper_holding:
        yield Check("grip", None, "the driver does not say that something is held", "holding of the driver's states")
    carry(drive_gripper(joints, closes=False))
