"""Process `feelahead-robot`: settings, parts, and `run`."""

import secrets
from collections.abc import Callable, Sequence
from typing import Final

from common.clock import clock_domain, wall_clock_offset_s
from common.command.command_line import parse_settings, run_command
from common.command.flag_value import with_value
from common.command.status import Status
from common.emulation.spec import unused_clauses
from common.files.audit_log import AuditLog
from common.loop.loop import Loop
from common.loop.process import Process
from common.recording.provenance import provenance
from common.sockets.door.client import Door
from common.sockets.door.messages import DoorSettings
from robot_side.compiled.kernel import late_kernels
from robot_side.compiled.warm_up import COMPILING, kernel_digests, kernels_compiled, warm_up
from robot_side.core.robot_parts import RobotParts
from robot_side.core.robot_side import RobotSide
from robot_side.drivers.mujoco.simulation_witness import witness_of
from robot_side.drivers.mujoco.viewpoints import first_person_eye, overview_eye
from robot_side.drivers.remote.connected_drivers import ConnectedDrivers, driver_ports
from robot_side.parts import SceneParts, build_parts, take_limits
from robot_side.perceiving.starting import surfaced
from robot_side.recording.recorder import RobotEncoder
from robot_side.recording.true_states import recorders
from robot_side.settings import RobotSettings
from robot_side.tick.events import Listener
from robot_side.tick.outgoing import SENT_STREAMS
from robot_side.tick_times import PhysicsTime
from robot_side.turns import RobotTurns, audit_writer
from robot_side.viewing.perceived_shapes import PerceivedModel
from robot_side.viewing.pictures import Cameras
from robot_side.viewing.scene_view import SceneView
from robot_side.viewing.shapes import SceneModel
from robot_side.viewing.surfaces import SurfaceModel

_REMEDY: Final = "fewer or simpler objects, a coarser cover (cover_m), fewer views and observers, or a faster machine"
_OPEN_TO_ALL: Final = "WITHOUT KEYS: anyone who reaches the port can move the arm"


Adapted = tuple[RobotParts, Sequence[Listener]]
"""Parts as an experiment changed them, and the experiment's listeners"""


def main() -> None:
    """Run the console script."""
    run_command("feelahead-robot", command)


def as_built(parts: RobotParts) -> Adapted:
    """Return the parts unchanged, without further listeners."""
    return parts, ()


def command(arguments: Sequence[str], adapt: Callable[[RobotParts], Adapted] = as_built) -> int:
    """Run the robot side until --duration, Ctrl-C or SIGTERM; the arm stands still however the program ends.

    adapt: takes the parts that were built; returns an experiment's parts and listeners.
    """
    arguments = with_value("--measure-limits", "ask", arguments)
    settings = parse_settings(RobotSettings, "feelahead-robot", arguments)
    if settings.measure_limits is not None:
        # Its fits would make each start a sixth longer.
        from robot_side.commissioning.measuring import measure  # noqa: PLC0415

        return measure(settings)
    ports = DoorSettings(
        settings.bind,
        settings.view_bind,
        driver_ports(settings.arm, settings.objects, settings.pictures),
        insecure=settings.insecure,
        keys=None if settings.keys is None else str(settings.keys),
    )
    status, loop = Status(settings.status, "robot"), Loop(settings.tick_period_s(), _REMEDY, settings.seed)
    with Process(settings, "robot", status, RobotEncoder(), loop) as process:
        epoch, recording = secrets.randbits(53), process.recording
        offset_s = wall_clock_offset_s()
        log = None if settings.audit is None else AuditLog(settings.audit, lambda: offset_s + loop.clock.now())
        if log is not None:
            process.stack.callback(log.close)
        door = process.stack.enter_context(Door(ports, process.note))
        drivers = ConnectedDrivers(door, process.note)
        drivers.surfaces = surfaces = process.stack.enter_context(surfaced(settings, process.note, loop.clock.now()))
        parts = build_parts(settings, epoch, clock_domain(), announce=process.note, drivers=drivers, surfaces=surfaces)
        door.ready()
        recorder = (
            []
            if recording is None
            else recorders(witness_of(parts.scene, parts.arm), parts.truth, recording.noted.append)
        )
        core_parts, others = adapt(parts)
        physics = PhysicsTime(loop.clock, settings.seed)
        core = RobotSide(core_parts, [physics, *recorder, *others, *([] if surfaces is None else [surfaces])])
        write_audit = audit_writer(log, core, door, process.note)
        sent = [stream for stream in SENT_STREAMS if settings.cameras.on or stream != "video"]
        unused = unused_clauses(settings.link_spec(), [("to_operator", stream) for stream in sent])
        for text in unused:
            process.note(text)
        cameras = _cameras(settings, parts, drivers, process, loop.clock.now())
        warm_up(lambda ready, of: process.note(f"{COMPILING}: {ready} of {of} kernels are ready"), parts.kernels)
        drivers.wait(write_audit)
        if surfaces is not None:
            surfaces.wait(parts.arm, parts.scene, loop.clock, write_audit)
        settings, note = take_limits(settings, parts, drivers)
        if note:
            process.note(note)
        if recording is not None:
            also = {"kernels": kernel_digests(), "notes": parts.notes}
            recording.begin(provenance(settings, epoch, clock_domain()) | also)
        model = _shown(settings, parts)
        eyes = (first_person_eye(parts.scene), overview_eye(parts.scene)) if settings.cameras.on else (None, None)
        view = SceneView(model, parts.kinematics, parts.explains, parts.enlarged, parts.surroundings, *eyes)

        def open_side() -> RobotTurns:
            at = door.listen()
            process.note(f"listening at {at.control}, view at {at.view}")
            if settings.insecure and settings.keys is None:
                process.note(_OPEN_TO_ALL)
            status.event("listening", control=at.control, view=at.view)
            around = core, view, cameras, door, process, drivers, physics, write_audit
            turns = RobotTurns(settings, *around, kernels_compiled())
            process.stack.enter_context(late_kernels(turns.note_late))
            return turns

        return process.run(open_side)


def _cameras(
    settings: RobotSettings, parts: SceneParts, drivers: ConnectedDrivers, process: Process, now_s: float
) -> Cameras | None:
    """Return what makes pictures; None if none are wanted."""
    if not settings.cameras.on:
        return None
    cameras = Cameras(parts.scene, settings.cameras, process.note, sent=drivers.pictures)
    if settings.cameras.at_once:
        cameras.update(now_s, now_s, (), expected=True)
    return cameras


def _shown(settings: RobotSettings, parts: SceneParts) -> SceneModel:
    """Return what viewers see of the scene, by the kind of its objects."""
    if settings.by_depth:
        return SurfaceModel(parts.scene, parts.fixed, 1 + settings.depth_map.slots)
    return PerceivedModel(parts.scene) if parts.any_objects else SceneModel(parts.scene, parts.fixed)


if __name__ == "__main__":
    main()
