"""Haptics: from stiffness messages and our own commands to the writes to a controller."""

import dataclasses
import math
from typing import Any, Final

from common.protocol.messages import Compensation, MotionCommand, StiffnessUpdate
from common.reaction import WRITE_S
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, Feel, met
from operator_side.feel.blindness import Blindness
from operator_side.feel.commands_under_way import CommandsUnderWay, Displacement, Report
from operator_side.feel.path_ahead import CourseOnMap
from operator_side.feel.rendering import RenderingSettings, TriggerRendering
from operator_side.feel.write_bucket import WriteBucket
from operator_side.feel.zones import moving_along, needed_m
from operator_side.hands.travel_calibration import TravelCalibration

MAP_EXPIRES_S: Final = 1.0
"""Seconds by which a map may be older than the newest field before it expires; two maps are sent in that time."""


class Haptics:
    """Renders stiffness fields with our commands under way, and remembers the last write to the controller."""

    def __init__(
        self,
        settings: RenderingSettings,
        calibration: TravelCalibration,
        *,
        enabled: bool,
        swap_sides: bool,
        compensation: Compensation,
    ) -> None:
        self.writes = 0
        """Number of writes to a controller."""
        self.without_history = 0
        """Number of renderings that used the robot side's displacement, because ours was unknown."""
        self._settings = settings
        self._enabled = enabled
        self._swap_sides = swap_sides
        self._compensation = compensation
        self._bound = WriteBucket()
        self._written: Feel | None = RELEASED
        self._commands = CommandsUnderWay()
        self._commanding = False
        self._mapped: StiffnessUpdate | None = None
        self._traced: CourseOnMap | None = None
        self._traced_s = -math.inf
        self._scale = 1.0
        self.calibrate(calibration)

    def calibrate(self, calibration: TravelCalibration) -> None:
        """Render for a controller with this calibration from now on."""
        self.rendering = TriggerRendering(self._settings, calibration, swap_sides=self._swap_sides)
        self.rendering.scale(self._scale)

    def scale(self, speed_scale: float) -> None:
        """Render for commands that are travel times `speed_scale` from now on."""
        if speed_scale != self._scale:
            self._scale = speed_scale
            self.rendering.scale(speed_scale)

    def controller_found(self) -> None:
        """Forget the last write, as the found controller's state is unknown: release it first, then write again."""
        self._written = None if self._enabled else RELEASED

    def commanded(self, command: MotionCommand) -> None:
        """Add a command to the history; it holds until the next one.

        A command without hold-to-run counts as travel 0. Whether the arm is armed does not matter here: rendering
        begins with a report that the arm is armed, and the arm follows all commands that are then under way.
        """
        if command.home > 0.0:  # the arm moves as we cannot know: the robot side's δ is used until a later echo
            self._commands = CommandsUnderWay()
        travel, sticks = command.r2 - command.l2, (*command.lateral, *command.turning)
        self._commands.sent(command.header.sent_s, *((travel, sticks) if command.run else (0.0,)))
        self._commanding = True

    def silent(self, now_s: float, *, owns: bool) -> None:
        """Note that no more commands are sent, so that the arm stops. owns: whether we have the lease.

        Without the lease the history is dropped, as another operator may drive the arm.
        """
        if not owns and len(self._commands) > 0:
            self._commands = CommandsUnderWay()
        elif self._commanding:
            self._commands.sent(now_s, 0.0)
        self._commanding = False

    def due(
        self, update: StiffnessUpdate | None, pulled: tuple[float, float], blindness: Blindness, now_s: float
    ) -> Feel | None:
        """Return the parts to write to the controller now; None if nothing has changed, or while a change must wait.

        update: the newest stiffness message; None without one, or while the arm is not armed. pulled: calibrated travel
        of the trigger that retreats, and of the one that advances.
        """
        if not self._enabled:
            return None
        aside = None if update is None else self._aside(update, now_s)
        known = None if update is None else self._displacement(update, now_s)
        self.without_history += update is not None and known is None and self._compensation == "operator"
        wanted = self.rendering.render(update, pulled, known, now_s, aside)
        if blindness.light is not None:
            rumble = blindness.rumble(now_s) if update is None else wanted.rumble
            wanted = dataclasses.replace(wanted, rumble=rumble, light=blindness.light)
        if wanted == self._written:
            return None
        before, shown = self._written, self._bound.next(self._written, wanted, now_s)
        if shown is None:
            return None
        self._written, self.writes = shown, self.writes + 1
        return shown if before is None else shown.change_from(before)

    def _displacement(self, update: StiffnessUpdate, now_s: float) -> Displacement | None:
        """Compute δ and w by our commands under way; None if unknown, or if the robot side compensates."""
        if self._compensation == "robot":
            return None
        return self._commands.displacement(now_s, _report(update), update.r2.acceleration_m_s2)

    def keep_map(self, update: StiffnessUpdate) -> None:
        """Keep `update` if its map is newer than the known one, even if `update` is late: few messages have maps."""
        known = self._mapped
        newer = known is None or known.header.epoch != update.header.epoch or known.header.sent_s < update.header.sent_s
        if update.around is not None and newer:
            self._mapped, self._traced_s = update, -math.inf

    def _aside(self, update: StiffnessUpdate, now_s: float) -> CourseOnMap | None:
        """Return the gripper's course on the newest map; None while the sticks rest, or without a map.

        The result is kept for WRITE_S, so that a path is traced only once for each write to the controller.
        """
        if not 0.0 <= now_s - self._traced_s < WRITE_S:
            self._traced, self._traced_s = self._newest_aside(update, now_s), now_s
        return self._traced

    def _newest_aside(self, update: StiffnessUpdate, now_s: float) -> CourseOnMap | None:
        mapped = self._mapped
        if mapped is None or mapped.around is None or self._compensation == "robot":
            return None
        header = mapped.header
        if header.epoch != update.header.epoch or update.header.sent_s - header.sent_s > MAP_EXPIRES_S:
            self._mapped = None
            return None
        course = self._commands.course(now_s, _report(mapped), mapped.around.changes_s())
        if course is None:
            return None
        return CourseOnMap(mapped.around, mapped.horizon_m, course, self._commands.sticks_at(now_s))

    def meets(self, raw: tuple[float, float]) -> tuple[int, int]:
        """Return the strengths, 0 to 8, that fingers at the raw travels of L2 and R2 meet in the zones last written."""
        return met(self.written.l2 or FREE_TRIGGER, raw[0]), met(self.written.r2 or FREE_TRIGGER, raw[1])

    def needed_m(self, update: StiffnessUpdate, pulled: tuple[float, float], now_s: float) -> tuple[float, float]:
        """Compute D_z of `feel/zones.py` at the present travel, for the retreating and for the advancing trigger.

        pulled: calibrated travel of the trigger that retreats, and of the one that advances.
        """
        back, forth = moving_along(update, self._displacement(update, now_s))
        (retreating, advancing), horizon_s = (self._scale * travel for travel in pulled), self._settings.horizon_s
        return (
            needed_m(update.l2, max(0.0, retreating - advancing) * update.l2.full_speed_m_s, back, horizon_s),
            needed_m(update.r2, max(0.0, advancing - retreating) * update.r2.full_speed_m_s, forth, horizon_s),
        )

    @property
    def written(self) -> Feel:
        """The last write; RELEASED before the first."""
        return self._written or RELEASED

    def summary(self) -> dict[str, Any]:
        """Return figures of the rendering for the run's summary."""
        return self.rendering.summary() | {"writes": self.writes, "without_history": self.without_history}


def _report(update: StiffnessUpdate) -> Report:
    header = update.header
    echo = header.echo_sent_s, header.echo_held_s
    return Report(*echo, update.speed_m_s, update.r2.full_speed_m_s, update.commanded_m_s, update.response_s)
