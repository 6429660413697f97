"""Making of the parts of a robot side from its settings. Arm and objects are simulated or come from drivers."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from common.arrays import BoolArray
from common.errors import ConfigurationError
from common.protocol.link_end import LinkEnd
from common.roles import Role
from common.timing.ages import LoopAge
from robot_side.arm.following import Following
from robot_side.arm.limits import JointLimits
from robot_side.compiled.kernel import Compiled, imported_kernels
from robot_side.core.robot_parts import RobotParts
from robot_side.drivers.mujoco.arm import MujocoArm, stand
from robot_side.drivers.mujoco.checks.cost import cost_findings
from robot_side.drivers.mujoco.checks.following import following_findings
from robot_side.drivers.mujoco.checks.joints import joint_findings
from robot_side.drivers.mujoco.checks.reach import reach_findings, target_findings
from robot_side.drivers.mujoco.checks.site_axis import site_findings
from robot_side.drivers.mujoco.checks.start_collision import start_collision
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.gripper_measurement import GripperTravel
from robot_side.drivers.mujoco.hand.gripper_cover import GripperCover
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.drivers.mujoco.model_enums import JointKind
from robot_side.drivers.mujoco.robot_model import joint_names
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.drivers.mujoco.simulation_observer import SimulationObserver
from robot_side.drivers.mujoco.viewpoints import stick_frames
from robot_side.drivers.remote.arm import RemoteArm
from robot_side.drivers.remote.connected_drivers import ConnectedDrivers
from robot_side.drivers.remote.driver_session import ArmShape
from robot_side.drivers.remote.frame_build import perceived
from robot_side.gripper.held_covers import HeldCovers
from robot_side.gripper.kept_covers import SearchNotes
from robot_side.laws.enlarged_gripper import EnlargedGripper
from robot_side.laws.inputs import LawInputs
from robot_side.laws.named import make_law
from robot_side.laws.vicinity import misplaced_m
from robot_side.operators.episodes import Episodes
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Safety
from robot_side.operators.tuning import Tuning
from robot_side.perceiving.object_source import simulated_camera, source_of, with_known
from robot_side.settings import RobotSettings
from robot_side.surroundings.fixed_objects import fixed_objects, with_fixed
from robot_side.surroundings.perceived import KINDS, ObjectSource, PerceivedObjects, PutBack
from robot_side.surroundings.surroundings import Surroundings

if TYPE_CHECKING:
    from robot_side.laws.named import NamedLaw

_NAMED_OBJECTS = 8
"""Maximum number of objects that a note names"""


@dataclass(frozen=True, kw_only=True)
class SceneParts(RobotParts):
    """Parts with their scene, which is simulated or follows the drivers of arm or objects."""

    kinematics: MujocoKinematics
    scene: Scene
    fixed: PerceivedObjects
    """Objects that are always there, whatever a camera sees"""
    any_objects: bool
    """Whether objects of any kind may appear during the run"""
    explains: "NamedLaw"
    """Law named in the settings, even if an experiment replaces `law`"""
    enlarged: EnlargedGripper

    @property
    def kernels(self) -> list[Compiled]:
        """Kernels that ticks may run; the overlap kernel of a kind of primitive that the scene lacks is left out.

        A scene's primitives stay the same during a run. The primitives of ignored objects count, too.
        """
        seen = as_loaded(self.scene, dict.fromkeys(self.scene.roles, Role.OBSTACLE))
        held = {kind for kind in KINDS if len(getattr(seen, kind.owner)) + len(getattr(self.fixed, kind.owner))}
        unneeded = {kind.kernel for kind in KINDS if not (self.any_objects or kind in held)}
        return [kernel for kernel in imported_kernels() if kernel not in unneeded]


def build_parts(
    settings: RobotSettings,
    epoch: int,
    clock_domain: str,
    scene: Scene | None = None,
    announce: Callable[[str], None] | None = None,
    drivers: ConnectedDrivers | None = None,
    law: object = None,
    surfaces: ObjectSource | None = None,
) -> SceneParts:
    """Make the parts; ConfigurationError for a model that cannot be used.

    scene: used instead of the scene that the settings name. announce: called with each note as soon as it is known, so
    that those about the model come before a long search. drivers: the connected drivers, whose arm and objects replace
    the simulated ones. law: used instead of the law that the settings name (see `OwnLaw`). surfaces: source by depth
    cameras in another process, for --depth or --perception depth; None: the simulated ones work in this process.
    """
    if (settings.model is None) != (settings.site is None):
        given, missing = ("--model", "--site") if settings.site is None else ("--site", "--model")
        raise ConfigurationError(f"{given} is given without {missing}; valid: both, or neither for the built-in arm")
    # A driver's objects are not known yet.
    roles = settings.roles if settings.objects is None else {}
    scene = scene or load_scene(
        settings.model, settings.site, roles, settings.scene or "table", settings.seed, settings.site_axis
    )
    noise, camera_noise = np.random.SeedSequence(settings.seed).generate_state(2)
    encoder = Encoder(settings.encoder.sigma_rad, settings.encoder.resolution_rad, int(noise))
    arm, limits, travel = _arm(scene, encoder, settings, drivers)
    notes = _notes(scene, settings, travel)
    if settings.model is not None and isinstance(arm, MujocoArm):
        notes += tuple(following_findings(scene, arm, limits))
    say = announce or (lambda _: None)
    for text in notes:
        say(text)
    searching = None if announce is None else SearchNotes(announce)
    kinematics = MujocoKinematics(scene, settings.cover_m, searching)
    camera = simulated_camera(settings, scene, int(camera_noise))
    surroundings = Surroundings()
    about = settings.roles, settings.camera.unseen_m_s, surroundings.see
    sent = None if drivers is None else drivers.objects(*about)
    fixed = fixed_objects(settings.workspace_m, settings.arm_keep_out)
    source = with_known(settings, surfaces or source_of(settings, scene, camera, int(camera_noise)), sent, camera)
    # Before the first tick, as a search for spheres takes far longer than one.
    first = perceived([], [], 0.0) if settings.sees_any else as_loaded(scene, scene.roles)
    held_covers = HeldCovers(first, settings.cover_m, scene.never_held, searching)
    prediction, prediction_note = settings.prediction_for(scene.robot.fingerprint)
    errors = settings.uncertainty(prediction)
    encoder_sigma_rad = np.full(arm.joint_count, encoder.standard_deviation_rad())
    inputs = LawInputs(errors, encoder_sigma_rad, limits, settings.capped_motion, surroundings, settings.paper)
    law = make_law(settings.law if law is None else law, inputs)
    enlarged = EnlargedGripper(inputs)

    def expect(probability: float) -> None:
        law.expect(probability)
        enlarged.expect(probability)

    link = settings.seed, settings.asymmetry_s(), settings.tick_period_s()
    late = *prediction_note, *_cover_notes(kinematics.cover, settings.cover_m, held_covers)
    for text in late:
        say(text)
    return SceneParts(
        arm=arm,
        kinematics=kinematics,
        # Depth cameras' frames have the fixed objects already.
        camera=source if settings.by_depth else with_fixed(source, fixed),
        fixed=fixed,
        law=law,
        explains=law,
        enlarged=enlarged,
        surroundings=surroundings,
        session=OperatorSession(
            lambda: LinkEnd("robot", epoch, clock_domain, *link),
            Safety(settings.safety),
            settings.seed,
            Tuning(settings.probability, expect if settings.permit_tuning else None),
            _episodes(settings, arm, dict.fromkeys((camera, source))),
        ),
        loop_age=LoopAge(settings.assumed_delay_s),
        limits=limits,
        following=Following(limits, joint_names(scene)[0], encoder.standard_deviation_rad()),
        misplaced_m=lambda objects: misplaced_m(objects, errors),
        home_rad=scene.data.qpos[scene.robot.arm_positions].copy(),
        frames=stick_frames(scene),
        motion=settings.capped_motion,
        scene=scene,
        any_objects=settings.sees_any,
        truth=SimulationObserver(scene) if settings.simulates_all else None,
        held_covers=held_covers,
        bounds=settings.bounds,
        assists=settings.assist == "speed",
        full_rate=settings.full_rate,
        seed=settings.seed,
        notes=(*notes, *late),
    )


def take_limits(settings: RobotSettings, parts: SceneParts, drivers: ConnectedDrivers) -> tuple[RobotSettings, str]:
    """Take the limits that the arm's driver says, where the settings give none.

    Return the settings with them, and a note for a person. ConfigurationError if both make an arm that is too late.
    """
    if not drivers.has_arm:
        return settings, ""
    said, given = drivers.said_limits(), settings.arm_limits
    limits = given.unless_known(said)
    try:
        parts.limits.take(limits.of_joints(parts.arm.joint_count))
    except ValueError as error:  # each is valid, and both together are not
        raise ConfigurationError(f"{error}; {given.sources(said)}") from None
    drivers.limits_taken()
    return replace(settings, arm_limits=limits), f"the arm's limits: {given.sources(said)}"


def _episodes(settings: RobotSettings, arm: MujocoArm | RemoteArm, sources: Iterable[ObjectSource]) -> Episodes:
    """Return the judge of marks: a driver's arm does not go home by itself, nor do objects that are seen elsewhere."""
    driven = [f"--{what}" for what in ("arm", "objects", "depth") if getattr(settings, what) is not None]
    if driven or not isinstance(arm, MujocoArm):
        return Episodes(refuses=f"{' and '.join(driven)}: a driver's things stay; valid: all simulated")

    def put_back() -> None:
        arm.put_back()
        for source in sources:
            if isinstance(source, PutBack):
                source.put_back()

    return Episodes(put_back)


def _arm(
    scene: Scene, encoder: Encoder, settings: RobotSettings, drivers: ConnectedDrivers | None
) -> tuple[MujocoArm | RemoteArm, JointLimits, GripperTravel | None]:
    """Return the arm, simulated or a driver's; its joints' limits; the gripper's travel.

    ConfigurationError if the settings give limits for another number of joints.
    """
    robot, (travel, ends_rad) = scene.robot, stand(scene)
    joints = len(robot.arm_joints), *ends_rad, _slides(scene)
    try:
        limits = settings.arm_limits.of_joints(*joints)
        moves = limits if settings.simulated_limits is None else settings.simulated_limits.of_joints(*joints)
    except ValueError as error:
        raise ConfigurationError(str(error)) from None
    if drivers is None or not drivers.has_arm:
        simulated = MujocoArm(scene, encoder, moves)
        return simulated, limits, simulated.travel
    opening_m = 0.0 if travel is None else float(travel.openings_m[0])
    open_fingers = scene.data.qpos[robot.finger_positions].copy()
    shape = ArmShape(*joint_names(scene), open_fingers, opening_m, limits, encoder.standard_deviation_rad())
    return drivers.arm(shape, scene.show), limits, travel


def _slides(scene: Scene) -> BoolArray:
    """Return whether each of the arm's joints slides, (n,)."""
    slides: BoolArray = scene.model.jnt_type[scene.robot.arm_joints] == JointKind.SLIDE
    return slides


def _notes(scene: Scene, settings: RobotSettings, travel: GripperTravel | None) -> tuple[str, ...]:
    """Return the notes shown before the run: start pose, objects and their roles, and shapes that are not exact."""
    notes = [f"the arm starts at {scene.start_pose}"]
    if settings.arm is not None:
        joints, fingers = (", ".join(names) or "none" for names in joint_names(scene))
        notes = [f"the driver's joints, in this order: {joints}; of the gripper: {fingers}"]
    if settings.model is not None:
        notes += site_findings(scene, settings.site_axis, travel)
        notes += start_collision(scene) if settings.arm is None else []
    if settings.objects is not None or settings.depth is not None:
        return tuple(notes)
    notes.append(f"objects: {_roles(scene.roles)}")
    if scene.model.nflex:
        notes.append("the model's flexes (deformable bodies) are not perceived: nothing warns of them")
    notes += target_findings(scene)
    notes += [
        f"{name!r} names several things, such as a body and a geom of the world: they count as one object"
        for name in scene.shared_names[:_NAMED_OBJECTS]
    ]
    shapes = scene.primitives
    if shapes.volume_errors:
        largest_first = sorted(shapes.stands_out_m.items(), key=lambda item: -item[1])
        shown = [
            f"{name} by {1e3 * reach_m:.2f} mm ({100.0 * shapes.volume_errors[name]:.1f} % of its volume)"
            if math.isfinite(reach_m)
            else f"{name} as its convex hull or bounding box"
            for name, reach_m in largest_first[:_NAMED_OBJECTS]
        ]
        if len(largest_first) > len(shown):
            shown.append(f"and {len(largest_first) - len(shown)} more, none by more than these")
        notes.append(f"perceived larger than they are, at most: {', '.join(shown)}")
    if settings.model is not None and settings.arm is None:
        notes += joint_findings(scene, travel) + reach_findings(scene) + cost_findings(scene)
    return tuple(notes)


def as_loaded(scene: Scene, roles: Mapping[str, Role]) -> PerceivedObjects:
    """Return the objects as the scene starts, without the primitives of ignored objects."""
    nowhere = np.zeros((len(scene.objects), 3))
    return scene.primitives.perceived(0.0, roles, nowhere, scene.data.geom_xpos, scene.data.geom_xmat)


def _cover_notes(cover: GripperCover, asked_m: float, held: HeldCovers) -> list[str]:
    """Return the notes about spheres that protrude farther than `asked_m`."""
    notes = []
    if cover.stand_out_m > asked_m * (1.0 + 1e-9):
        notes.append(
            f"the gripper's {len(cover.radii_m)} spheres protrude from it by up to {1e3 * cover.stand_out_m:.1f} mm"
            f" instead of {1e3 * asked_m:.1f}: its links are large or of many faces"
        )
    if held.coarse:
        shown = [f"{name} by {1e3 * stand_out:.0f} mm" for name, stand_out in held.coarse[:_NAMED_OBJECTS]]
        more = [f"and {len(held.coarse) - len(shown)} more"] if len(held.coarse) > len(shown) else []
        notes.append(f"felt early while held, because their spheres protrude: {', '.join([*shown, *more])}")
    return notes


def _roles(roles: Mapping[str, Role]) -> str:
    """Return the names of the objects grouped by role, the target first."""
    shown = []
    for role in (Role.TARGET, Role.OBSTACLE, Role.SUPPORT, Role.IGNORED):
        names = [name for name, has in roles.items() if has is role]
        if names:
            more = [f"and {len(names) - _NAMED_OBJECTS} more"] if len(names) > _NAMED_OBJECTS else []
            shown.append(f"{role.value}: {', '.join([*names[:_NAMED_OBJECTS], *more])}")
    return "; ".join(shown) or "none"
