"""Run the robot side's core again with its recorded inputs, and compare its output with the recorded one."""

from collections import deque
from collections.abc import Mapping
from dataclasses import replace

from common.arrays import FloatArray
from common.errors import ConfigurationError
from common.files.plugged import is_elsewhere
from common.recording.entries import Kind, split_text
from common.recording.provenance import processor_name, settings_from
from common.recording.reading import Recording
from common.roles import Role
from feelahead.recordings.comparison import Comparison, differing_origin, recorded_entries, require_side
from robot_side.arm.port import Arm, ArmState
from robot_side.compiled.warm_up import import_kernels, kernel_digests, warm_up
from robot_side.core.robot_side import RobotSide
from robot_side.parts import build_parts
from robot_side.recording.arm_states import unpack_state
from robot_side.recording.frames import FrameUnpacker
from robot_side.settings import RobotSettings
from robot_side.surroundings.perceived import PerceivedObjects


class _Given(Arm):
    """Arm and ObjectSource in one, which return the recorded values and ignore commands."""

    joint_count = 0

    def __init__(self, joint_count: int) -> None:
        self.joint_count = joint_count
        self.newest_state: ArmState | None = None
        self.newest_frame: PerceivedObjects | None = None

    def command(self, joint_velocity_rad_s: FloatArray, valid_until_s: float) -> None:
        """Do nothing."""

    def command_gripper(self, closing: float, valid_until_s: float) -> None:
        """Do nothing."""

    def state(self, now_s: float) -> ArmState:
        """Return the newest recorded state of the arm; ConfigurationError before the first."""
        if self.newest_state is None:
            raise ConfigurationError(
                f"no state of the arm is recorded before {now_s} s; valid: a recording with its beginning"
            )
        return self.newest_state

    def perceive(self, now_s: float) -> PerceivedObjects:
        """Return the newest recorded frame; ConfigurationError before the first."""
        if self.newest_frame is None:
            raise ConfigurationError(
                f"no frame of objects is recorded before {now_s} s; valid: a recording with its beginning"
            )
        return self.newest_frame

    def set_role(self, name: str, role: Role) -> None:
        """Do nothing: the recorded frames contain the roles."""


def replay_robot(recording: Recording) -> Comparison:
    """Compute the robot side's messages again and compare them; ConfigurationError if the side was not recorded."""
    header = require_side(recording, "robot")
    settings = replace(settings_from(header["settings"], RobotSettings), perception=None)  # its frames are recorded
    if is_elsewhere(settings.law):  # a recording may be anybody's, and must run nobody's code
        raise ConfigurationError(
            f"recorded with the law {settings.law}, which replay does not run; valid: a built-in law, or"
            " one of an installed package; what works: feelahead replay without --check, export, plot"
        )
    parts = build_parts(settings, header["epoch"], header["clock_domain"])
    given = _Given(parts.arm.joint_count)
    frames = FrameUnpacker(parts.camera.perceive(0.0))
    # Without a truth to observe, as nothing moves in this simulation.
    core = RobotSide(replace(parts, arm=given, camera=given, truth=None))
    compared, recorded = Comparison("robot", "stiffness messages"), _by_last_names(header.get("kernels", {}))
    if not recorded.keys() <= _by_last_names(kernel_digests()).keys():
        import_kernels()  # those of other scenes and laws, too
    warm_up()
    here = _by_last_names(kernel_digests())
    if gone := [name for name in recorded if name not in here]:
        raise ConfigurationError(
            f"recorded by another version, with {len(gone)} kernels that this version lacks, such as {gone[0]}: its"
            " robot side cannot be replayed; what works: feelahead replay without --check, export, plot"
        )
    kernels = {name: here.get(name) for name in recorded}
    origin = {"processor": processor_name(), "kernels": kernels}
    compared.notes += differing_origin({**header, "kernels": recorded}, origin)
    made: deque[bytes] = deque()
    for entry in recorded_entries(recording, "robot", compared.notes):
        if entry.kind == Kind.RECEIVED:
            peer, payload = split_text(entry.content)
            core.receive(peer, payload, entry.now_s)
        elif entry.kind == Kind.STATE:
            given.newest_state = unpack_state(entry.content)
        elif entry.kind == Kind.FRAME:
            given.newest_frame = frames.unpack(entry.content)
            core.sight.see(entry.now_s)
        elif entry.kind == Kind.TICK:
            compared.missed(made)
            made.extend(one.payload for one in core.tick(entry.now_s))
        elif entry.kind == Kind.SENT:
            payload = split_text(split_text(entry.content)[1])[1]
            compared.compare(payload, made.popleft() if made else None)
    compared.missed(made)
    return compared


def _by_last_names(digests: Mapping[str, str]) -> dict[str, str]:
    """Return the digests by file and function, so that a kernel that moved to another package counts as the same."""
    return {".".join(name.split(".")[-2:]): digest for name, digest in digests.items()}
