"""The law "swept": the gripper, inflated by D_σ, is moved along each trigger until it overlaps something (§4.2).

    motion ─▶ path ─▶ prospect: errors, ability ─▶ looks ─▶ field

A look evaluates the law along one direction from one pose. Looks along R2, L2, and the stick while it is deflected are
made every 8 ms, and at once if something changes; against the motion every 30 ms, at rest every 50 ms. Between looks
the tool's motion is subtracted from the onset distances, which is exact for a translation. The shortest onset distances
of the last 0.1 s count: where the gripper just passes an object, encoder noise alone can switch between no strength and
full strength.

While the gripper drifts, turns, or moves its fingers, looks along R2 and L2 are also made from waypoints on its path
(`path`). The path ends where a command sent now has stopped the gripper. An operator side that traces its own sticks
gets a map of onset distances around the gripper instead (`around`). An object that approaches has its contact
distances shortened by its motion until the gripper has stopped.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from common.arrays import FloatArray
from common.protocol.around import MOST_JOINTS, Around
from common.protocol.messages import TriggerField
from common.protocol.view_messages import EnlargementTerms
from common.skipped import Part
from common.touch_speed import touch_speed_m_s
from robot_side.arm.ability import change_times_s
from robot_side.arm.port import GripperPose
from robot_side.arm.tool_motion import full_twists
from robot_side.field.field import Ahead
from robot_side.field.object_class import SKIPPED
from robot_side.field.scratch import Count
from robot_side.laws.around import ProbeLooks
from robot_side.laws.changes import differs, have_moved, is_due, rests
from robot_side.laws.classes import classes_of
from robot_side.laws.explanation import explained
from robot_side.laws.gripper_motion import FingerSpeeds, gripper_motion
from robot_side.laws.inputs import LawInputs
from robot_side.laws.law import MOST_M, require_usable
from robot_side.laws.looking import Looking, Seen
from robot_side.laws.path import Waypoint
from robot_side.laws.prospect import Asked, Assumed, horizon_m
from robot_side.laws.trigger_field import rumble, trigger_field
from robot_side.tick.explained import Trigger
from robot_side.tick.sensed import L2, R2, STICK, Sensed
from robot_side.tick.situation import Situation

_WORK: Final = {
    "looks_cut": Count.CUT,
    "pairs_touching": Count.PAIRS,
    "pairs_entered": Count.ENTERED,
    "profiles": Count.PROFILES,
    "overlaps": Count.OVERLAPS,
    "spheres_limited_by_gap": Count.LIMITED,
}
"""Names of the looks' counts in the summary"""
_AT_REST: Final[FloatArray] = np.empty((0, 3))


class SweptLaw:
    """The law "swept". It keeps the recent looks along each side."""

    def __init__(self, inputs: LawInputs, *, maps: bool = False) -> None:
        """maps: whether to look from probes, too, for a map around the gripper."""
        self.surroundings = inputs.surroundings
        # A map's message has room for so many joints.
        probes = ProbeLooks() if maps and len(inputs.encoder_sigma_rad) <= MOST_JOINTS else None
        self.looking = Looking(Ahead(inputs.encoder_sigma_rad), probes)
        self.assumed = Assumed(inputs.uncertainty, inputs.limits, inputs.motion)
        self._twists = full_twists(inputs.motion)
        self._touch_speed_m_s = touch_speed_m_s(inputs.motion.trigger_speed_m_s)
        self._fingers = FingerSpeeds()
        self._last: Seen | None = None
        """Last tick that looked"""
        self._sensed: Sensed | None = None
        self._ticks_without_looks = 0

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        """Return the fields and the rumble of one tick.

        ValueError for wrong sizes and for numbers that are not finite; earlier looks then stay.
        """
        require_usable(situation, len(self.looking.ahead.encoder_sigma_rad), now_s)
        seen, last = self._see(situation, self._fingers.measure(situation.pose, now_s), now_s), self._last
        probes = self.looking.probes
        if probes is not None:
            probes.advance(now_s)
        if last is None or is_due(seen, last, waits=probes is not None and probes.waits):
            if probes is not None and (
                last is None or seen.classes.meant != last.classes.meant or seen.assumed is not last.assumed
            ):
                probes.discard()
            self.looking.look(seen, changed=last is None or differs(seen, last) or have_moved(seen, last))
            self._last = seen
        else:
            self.looking.pass_tick(seen)
            self._ticks_without_looks += 1
            if self._sensed is not None and rests(seen, last):
                return self._sensed
        self._sensed = self._field(seen)
        return self._sensed

    def _see(self, situation: Situation, fingers_m_s: FloatArray | None, now_s: float) -> Seen:
        objects, held, last = situation.objects, situation.held, self._last
        kept = last is not None and last.classes.fit(objects, held)
        return Seen(
            situation,
            gripper_motion(situation.pose, situation.joint_velocities_rad_s, fingers_m_s),
            self.assumed,
            last.classes if last is not None and kept else classes_of(objects, held),
            self.surroundings.see(objects),
            now_s,
            math.inf if last is None else now_s - last.now_s,
        )

    def _field(self, seen: Seen) -> Sensed:
        """Return both triggers' fields and the rumble, from the recent looks."""
        situation, motion, looking = seen.situation, seen.motion, self.looking
        tool_m, age_s, ahead_m_s = situation.pose.tool_position_m, situation.loop_age_s, motion.ahead_m_s
        known_m = min(
            min(horizon_m(looking.newest[side].able, age_s), looking.newest[side].known_m(tool_m)) for side in (R2, L2)
        )

        def field(side: int, under_way_m_s: float) -> TriggerField:
            able, onsets_m = looking.newest[side].able, looking.sides[side].shortest_m(tool_m)
            # Commands under way from an operator who has echoed nothing are unknown: full speed is the worst case.
            if not situation.loop_age_known:
                under_way_m_s = max(under_way_m_s, able.full_speed_m_s)
            return trigger_field(onsets_m, able, under_way_m_s * age_s, known_m)

        deflection, shakes = math.hypot(*situation.lateral), 0.0
        if deflection > 0.0:
            speed_m_s = self.assumed.motion.stick_speed_m_s * min(deflection, 1.0)
            onsets_m = looking.sides[STICK].shortest_m(tool_m)
            shakes = rumble(onsets_m, looking.newest[STICK].able, speed_m_s, self._touch_speed_m_s, age_s)
        leading = looking.newest[R2 if ahead_m_s >= 0.0 else L2]
        return Sensed(
            r2=field(R2, ahead_m_s),
            l2=field(L2, -ahead_m_s),
            speed_m_s=min(max(ahead_m_s, -MOST_M), MOST_M),
            horizon_m=min(max(known_m, 0.0), MOST_M),
            rumble=shakes,
            enlargement_m=motion.speed_m_s * age_s + leading.sigma_m,
            tool_speed_m_s=motion.speed_m_s,
            cut=looking.cut is not None,
        )

    def expect(self, probability: float) -> None:
        """Set the probability P of eq. 10; ConfigurationError outside (0, 1)."""
        uncertainty = replace(self.assumed.uncertainty, probability=probability)
        self.assumed = replace(self.assumed, uncertainty=uncertainty)

    def around(self, pose: GripperPose) -> Around | None:
        """Return the map of onset distances around `pose`; None if nobody asked for it, or it is not valid."""
        probes, last, sensed = self.looking.probes, self._last, self._sensed
        if probes is None or last is None or sensed is None or not probes.known:
            return None
        velocities_m_s = last.situation.objects.velocities_m_s
        felt_m_s = _AT_REST if velocities_m_s is None else velocities_m_s[last.classes.usual != SKIPPED]
        onsets_m = probes.onsets_m(pose, sensed, felt_m_s)
        return Around.of(probes.full_s, onsets_m, change_times_s(pose, self.assumed.limits, self._twists))

    def look_around(self, situation: Situation, now_s: float) -> None:
        """Look from all probes at once, so that the whole map is of one moment; a run spreads these looks over time."""
        self.looking.look_around(self._see(situation, None, now_s))

    def summary(self) -> dict[str, int]:
        """Return counts over the run: looks, and their work (see `_WORK`).

        `looks_with_nothing_near`: in which no sphere touched an object within the examined distance.
        `flat_primitives`: those of the newest scene without volume. Nothing can overlap them, so they are not felt.
        """
        looking = self.looking
        return {
            "looks": looking.looks,
            "looks_with_nothing_near": looking.with_nothing_near,
            "ticks_without_looks": self._ticks_without_looks,
            "flat_primitives": 0 if self._last is None else self._last.scene.flat,
        } | {name: int(looking.work[count]) for name, count in _WORK.items()}

    def skipped(self) -> dict[str, Part]:
        """Return the pairs that were examined, of all spheres with all primitives in all looks; and the looks made."""
        looking = self.looking
        return {
            "pairs": Part(int(looking.work[Count.ENTERED]), looking.pairs),
            "looks": Part(looking.looks, looking.at_full_rate),
        }

    def explain(self, trigger: Trigger, situation: Situation, sensed: Sensed) -> EnlargementTerms:
        """Return the terms of D_σ along one trigger."""
        felt, side = (sensed.l2, L2) if trigger == "l2" else (sensed.r2, R2)
        along, sigma_rad = self.asked(side, situation).along, self.looking.ahead.encoder_sigma_rad
        return explained(situation, along, felt.displacement_m, sigma_rad)

    def asked(self, side: int, situation: Situation, waypoint: Waypoint | None = None) -> Asked:
        """Return the arguments of a look along one side, from the present pose or from a waypoint."""
        return self._see(situation, None, 0.0).prospect(side, waypoint).asked
