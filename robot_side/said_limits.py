"""Limits that an arm's driver says of its arm, before the first turn."""

from dataclasses import replace

from robot_side.arm.limits import ACCELERATION_RAD_S2, VELOCITY_RAD_S, ArmLimits
from robot_side.drivers.remote.connected_drivers import ConnectedDrivers
from robot_side.parts import SceneParts
from robot_side.settings import RobotSettings


def take_limits(settings: RobotSettings, parts: SceneParts, drivers: ConnectedDrivers) -> tuple[RobotSettings, str]:
    """Take the limits that the arm's driver says, where the settings give none.

    Return the settings with them, as a recording keeps them, and a note for a person; no note without --arm.
    """
    if not drivers.has_arm:
        return settings, ""
    said, given = drivers.said_limits() or ArmLimits(), settings.arm_limits
    limits = given.unless_known(said)
    parts.limits.take(limits.of_joints(parts.arm.joint_count))
    drivers.limits_taken()
    whose = {
        source: ", ".join(name for name, value in vars(of).items() if value is not None)
        for source, of in (("the settings", given), ("its driver", said))
    }
    told = "; ".join(f"{names} from {source}" for source, names in whose.items() if names)
    if limits.velocity_rad_s is None or limits.acceleration_rad_s2 is None:
        told += ("; " if told else "") + (
            f"not known: {VELOCITY_RAD_S:g} rad/s and {ACCELERATION_RAD_S2:g} rad/s² are assumed where they are missing"
            " (to measure them: feelahead-robot --measure-limits)"
        )
    return replace(settings, arm_limits=limits), f"the arm's limits: {told}"
