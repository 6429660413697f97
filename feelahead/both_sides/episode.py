"""An episode: both sides and their link in this process, in virtual time, built and driven by a few calls."""

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np
import numpy.typing as npt

from common.arrays import FloatArray
from common.emulation.spec import LinkSpec
from common.errors import ConfigurationError, FeelaheadError
from common.extras import require_packages
from common.link_model import LinkProfile
from common.protocol.view_messages import VIEW_NAMES, ViewName
from feelahead.both_sides.episode_hands import hands_of, why_not_armed
from feelahead.both_sides.episode_settings import absolute, law_setting, link_clauses, require_settings, side_settings
from feelahead.both_sides.history import Contact, History, Sampler
from feelahead.both_sides.loopback import VIRTUAL_CLOCK, Loopback, Person
from operator_side import events as operator_events
from operator_side.assembly import build_operator_side
from operator_side.controller.state import Button
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.people.arming_hands import ArmingHands
from operator_side.people.person import SimulatedOperator
from operator_side.people.port import FingerInput, Pulling
from operator_side.settings import OperatorSettings
from operator_side.viewing.pages.driving_page import DrivingPage
from robot_side.arm.own_arm import moved_by
from robot_side.compiled.warm_up import COMPILING, warm_up
from robot_side.core.robot_side import RobotSide
from robot_side.depth.camera_settings import BY_DEPTH
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.drivers.mujoco.simulation_witness import witness_of
from robot_side.drivers.mujoco.true_contact import TrueContact
from robot_side.parts import build_parts
from robot_side.perceiving.own_perception import perceived_by
from robot_side.recording.true_states import recorders
from robot_side.settings import RobotSettings
from robot_side.tick import events

if TYPE_CHECKING:
    from feelahead.both_sides.episode_recording import EpisodeRecording

LONGEST_ARMING_S: Final = 30.0
_LOOK_S: Final = 0.01
_DONE_S: Final = 0.05


class Episode:
    """Both sides, a simulated arm and controller, and the link between them, in virtual time.

    The same arguments give the same numbers on every machine. `history` has what happened.
    """

    def __init__(
        self,
        *,
        law: object = None,
        link: str | LinkProfile | Mapping[str, LinkProfile] = "",
        person: object = None,
        perception: object = None,
        arm: object = None,
        robot: RobotSettings | None = None,
        operator: OperatorSettings | None = None,
        device: SimulatedDualSense | None = None,
        world: Callable[[RobotSettings], Scene] | None = None,
        pages: DrivingPage | None = None,
        listeners: Sequence[events.Listener] = (),
        operator_listeners: Sequence[operator_events.Listener] = (),
        sampled: bool = True,
        **settings: Any,
    ) -> None:
        """Build both sides. `settings` are the flags of both sides by their names, such as scene, model, site, link,
        seed, haptics, probability or compensation; those that both have go to both.

        link: netem's words, a profile for both directions, or profiles by name, such as `to_robot` (`LinkSpec`).
        law: a name, a FILE.py, or an object (`robot_side.laws.own.OwnLaw`). person: who acts in `step` and `run`: an
        object with `act` (`operator_side.people.port.Person`) or what makes one, a FILE.py, `grasping`, or
        PersonSettings. perception, arm: functions that get the simulated camera, or arm, and return the one to
        use. robot, operator: all settings of a side. device: the simulated controller. world: loads the scene.
        sampled: whether there is a `history`.
        ConfigurationError names a setting that is unknown or out of range, and what is valid.
        """
        self._given = {name: value for name, value in settings.items() if value is not None}
        self._given |= {"link": link} if isinstance(link, str) and link else {}
        self._link = None if isinstance(link, str) else link_clauses(link)
        require_settings(self._given)
        self.law, self.person, self.perception, self.own_arm = map(absolute, (law, person, perception, arm))
        self._device, self._world, self._pages = device, world, pages
        self._bases = robot, operator
        self._recording: EpisodeRecording | None = None
        self._listeners, self._operator_listeners, self._sampled = listeners, operator_listeners, sampled
        self._build()

    def _build(self) -> None:
        named = self._given | law_setting(self.law)
        named |= {"perception": BY_DEPTH} if self.perception == BY_DEPTH else {}
        self.settings = robot = side_settings(RobotSettings, self._bases[0], named)
        self.operator_settings = side_settings(OperatorSettings, self._bases[1], self._given)
        if (robot.model is None) != (robot.site is None):
            given, missing = ("model", "site") if robot.site is None else ("site", "model")
            raise ConfigurationError(f"Episode: {given} is given without {missing}; valid: both, or neither")
        load = self._world or _load
        self.scene = load(robot)
        parts = build_parts(robot, 1, VIRTUAL_CLOCK, self.scene, law=None if isinstance(self.law, str) else self.law)
        self.parts = replace(
            parts,
            camera=perceived_by(None if self.perception == BY_DEPTH else self.perception, parts.camera),
            arm=moved_by(self.own_arm, parts.arm),
        )
        self._sampler = None
        if self._sampled:
            self._sampler = Sampler(lambda: self.loop, self.scene, TrueContact(self.scene))
        notes, listeners = self._recording, [*self._listeners]
        listeners += [] if self._sampler is None else [self._sampler]
        listeners += [self.parts.camera] if isinstance(self.parts.camera, events.Listener) else []
        if notes is not None:
            listeners += recorders(witness_of(self.scene, parts.arm), parts.truth, notes.note)
        robot_side = RobotSide(self.parts, listeners)
        warm_up(lambda *_: _say_compiling())  # after the scene was loaded, as it decides which kernels are imported
        hearing = [*self._operator_listeners, *([] if notes is None else [notes.operator])]
        operator = build_operator_side(self.operator_settings, 2, VIRTUAL_CLOCK, hearing)
        self.device = self._device or SimulatedDualSense()
        self._inputs = FingerInput()
        self._idle = ArmingHands(self.device, Pulling(lambda _: self._inputs))
        hands: Person = self._idle
        if self.person is not None:
            hands = hands_of(self.person, self.device, self.operator_settings)
        self.loop = Loopback(
            robot_side, operator, self.device, hands, robot, self.operator_settings, self._pages, self._link_spec()
        )

    def _link_spec(self) -> LinkSpec | None:
        settings = self.settings
        return None if self._link is None else LinkSpec(self._link, settings.seed, settings.link_model)

    @property
    def time_s(self) -> float:
        """Present virtual time, from the start of both sides."""
        return self.loop.clock.now()

    @property
    def armed(self) -> bool:
        """Whether the arm follows commands."""
        return self.loop.robot.session.safety.state == "armed"

    @property
    def history(self) -> History:
        """What happened so far; ValueError before anything did."""
        return self._samples.history()

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """True contacts of the gripper and what it holds, with their speeds, in order."""
        return tuple(self._samples.contacts)

    @property
    def tool_position_m(self) -> FloatArray:
        """True position (3,) of the tool, in the world frame."""
        position_m: FloatArray = self.scene.data.site_xpos[self.scene.robot.site].copy()
        return position_m

    @property
    def acts_since_s(self) -> float:
        """Time since when the hands act; FeelaheadError before."""
        hands = self.loop.person
        if not isinstance(hands, ArmingHands) or hands.began_s is None:
            raise FeelaheadError("the hands do not act; valid: after arm(), and not with the person grasping")
        return hands.began_s

    def arm(self) -> Self:
        """Run until the arm is armed and the hands act; FeelaheadError, with the reason, if that takes over 30 s."""
        hands, until_s = self.loop.person, self.time_s + LONGEST_ARMING_S
        while not self.armed or (isinstance(hands, ArmingHands) and hands.began_s is None):
            if self.time_s >= until_s:
                raise FeelaheadError(why_not_armed(self.loop, self.settings.link, LONGEST_ARMING_S))
            self._advance(self.time_s + _LOOK_S)
        return self

    def step(
        self,
        seconds: float,
        *,
        r2_n: float = 0.0,
        l2_n: float = 0.0,
        left_stick: tuple[float, float] = (0.0, 0.0),
        right_stick: tuple[float, float] = (0.0, 0.0),
        buttons: Sequence[Button] = (),
    ) -> Self:
        """Run for `seconds`, while the person acts; without a person, while the hands do what is given here.

        r2_n, l2_n: forces on the triggers, in newtons. Sticks: right and up positive, -1 to 1 each.
        """
        _require_seconds(seconds)
        self._inputs = FingerInput(r2_n, l2_n, left_stick, right_stick, frozenset(buttons))
        self._advance(self.time_s + seconds)
        return self

    def run(self, person: object = None, seconds: float = 60.0) -> Self:
        """Run until the person has finished, at most for `seconds`; person: as for the constructor, else that one."""
        _require_seconds(seconds)
        if person is not None:
            self.loop.person = hands_of(person, self.device, self.operator_settings)
        elif self.loop.person is self._idle:
            raise ValueError("run: there is no person; valid: run(person), or step(seconds, r2_n=...)")
        end_s = self.time_s + seconds
        while self.time_s < end_s and not self.done:
            self._advance(min(self.time_s + _DONE_S, end_s))
        return self

    @property
    def done(self) -> bool:
        """Whether the person has finished."""
        hands = self.loop.person
        return isinstance(hands, ArmingHands | SimulatedOperator) and hands.phase == "done"

    def reset(self, seed: int | None = None) -> Self:
        """Begin anew, with all settings as before but the seed, if one is given.

        Laws, people and other parts that were given as classes, functions or files are made anew; objects are kept.
        """
        if self._device is not None:
            raise ValueError("reset: a controller that was given cannot begin anew; valid: Episode without device")
        given = self._given | ({} if seed is None else {"seed": seed})
        side_settings(RobotSettings, self._bases[0], given)
        self.close()
        self._given = given
        self._build()
        return self

    def summary(self) -> dict[str, Any]:
        """Return the run's figures, as the demo's `--summary`."""
        return self.loop.summary()

    def picture(self, view: ViewName = "overview", *, width: int = 640, height: int = 480) -> npt.NDArray[np.uint8]:
        """Return what the camera sees now, RGB (height, width, 3); FeelaheadError where nothing can be rendered."""
        if view not in VIEW_NAMES:
            raise ValueError(f"view = {view!r}; valid: {', '.join(VIEW_NAMES)}")
        from feelahead.both_sides.snapshots import Snapshots  # noqa: PLC0415  # needs Pillow, and a process

        with Snapshots(self.scene, width, height) as snapshots:
            return snapshots.take(view)

    def record(self, path: str | Path, *, wall_clock_s: float = 0.0) -> Self:
        """Record into the new file `path`, which `close`, `reset` or the end of a `with` finishes; before the start.

        wall_clock_s: time of day, in seconds since 1970, at the start.
        """
        require_packages(f"record {path}", "foxglove", "mcap")
        from feelahead.both_sides.episode_recording import EpisodeRecording  # noqa: PLC0415  # needs mcap

        if self.time_s > 0.0:
            raise ValueError(f"record {path}: the episode is at {self.time_s:.2f} s; valid: before it begins")
        if self._recording is not None:
            raise ValueError(f"record {path}: a recording has begun already; valid: one, or reset() first")
        parts = {"person": self.person, "perception": self.perception, "arm": self.own_arm, "link": self._link}
        given = {name: str(part) for name, part in parts.items() if part is not None}
        self._recording = EpisodeRecording(Path(path), self.settings, self.operator_settings, wall_clock_s, given)
        self._build()
        self._recording.follow(self.loop)
        return self

    def close(self) -> None:
        """Finish the recording, if there is one."""
        recording, self._recording = self._recording, None
        if recording is not None:
            recording.close(self.time_s)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _advance(self, end_s: float) -> None:
        if self._recording is not None:
            while (block_s := self._recording.next_s) <= end_s:
                self.loop.run_until(block_s)
                self._recording.write(block_s)
        self.loop.run_until(end_s)

    @property
    def _samples(self) -> Sampler:
        if self._sampler is None:
            raise ValueError("the episode is not sampled; valid: Episode(sampled=True)")
        return self._sampler


def _require_seconds(seconds: float) -> None:
    if not (isinstance(seconds, int | float) and math.isfinite(seconds) and seconds >= 0.0):
        raise ValueError(f"seconds = {seconds!r}; valid: a number from 0 on")


@cache
def _say_compiling() -> None:
    """Say on standard error, once in this process, that kernels are compiled."""
    sys.stderr.write(f"feelahead: {COMPILING}\n")


def _load(settings: RobotSettings) -> Scene:
    name = settings.scene or "table"
    return load_scene(settings.model, settings.site, settings.roles, name, settings.seed, settings.site_axis)
