"""History of an episode: named arrays on one time base, with the simulation's truth."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from common.arrays import BoolArray, FloatArray
from common.extras import require_packages
from robot_side.tick import events
from robot_side.tick.events import Listener

if TYPE_CHECKING:
    from feelahead.both_sides.loopback import Loopback
    from robot_side.drivers.mujoco.scene import Scene
    from robot_side.drivers.mujoco.true_contact import TrueContact

PERIOD_S: Final = 0.008
"""Time from one sample to the next: two turns"""
_AXES: Final = {
    "_m": ("x", "y", "z"),
    "strengths": tuple(map(str, range(1, 11))),
    "onset_distances_m": tuple(map(str, range(1, 9))),
}
_TRIGGERS: Final = ("l2", "r2")


@dataclass(frozen=True)
class Contact:
    """Beginning of a true contact."""

    time_s: float
    thing: str
    """Name of the object that is touched"""
    gripper_part: str
    """Name of the geom, of the gripper or of the held object, that touches it"""
    speed_m_s: float
    """Closing speed along the contact's normal"""


@dataclass(frozen=True)
class History:
    """Samples of an episode, each at the first turn after a further 8 ms. NaN: unknown.

    Along a trigger's axis L2 comes first, then R2.
    """

    time_s: FloatArray
    """(n,) virtual time, which both sides share"""
    armed: BoolArray
    """(n,) whether the arm follows commands"""
    tool_position_m: FloatArray
    """(n, 3) true position of the tool, in the world frame"""
    approach_speed_m_s: FloatArray
    """(n,) true speed of the tool along its approach axis, along which R2 advances; negative while it retreats"""
    joint_positions_rad: FloatArray
    """(n, j) true positions of the arm's joints; metres for a prismatic joint"""
    travel: FloatArray
    """(n, 2) mechanical travel of the triggers, 0 to 1"""
    strengths: FloatArray
    """(n, 2, 10) strength of each zone of the triggers, 0 to 8, as the controller has it"""
    strength: FloatArray
    """(n, 2) strength of the zone that each trigger has reached, 0 to 8; 0 for a trigger that is not pulled"""
    onset_distances_m: FloatArray
    """(n, 2, 8) ways along the trigger's direction at which the strengths begin, as the law found them, at most the
    horizon: the fast list, which zones above 45 mm/s use"""
    rumble: FloatArray
    """(n,) drive of the left motor, 0 to 1"""
    enlargement_m: FloatArray
    """(n,) enlargement along the motion, D_incr of eq. 10; 0 by a law that tells none"""
    overlap_m3: FloatArray
    """(n,) volume that the gripper, inflated by D_σ and moved by δ of the trigger that leads, shares with all objects;
    at 10 Hz, under any law, to 1 % or 100 mm³"""
    loop_age_s: FloatArray
    """(n,) t_d of eq. 8; the configured worst case while unknown"""
    true_gap_m: FloatArray
    """(n,) least distance from the true gripper to any object that it does not hold, at most 1 m"""
    contact_speed_m_s: FloatArray
    """(n,) closing speed of the fastest contact that has begun since the sample before; NaN without one"""

    def to_pandas(self) -> Any:
        """Return a pandas.DataFrame with a column a number, such as `tool_position_m_x` or `strengths_r2_10`."""
        require_packages("to_pandas", "pandas", extra="study")
        import pandas as pd  # noqa: PLC0415  # its users have it

        columns: dict[str, Any] = {}
        for field in fields(self):
            values = getattr(self, field.name)
            for index in np.ndindex(values.shape[1:]):
                columns["_".join([field.name, *_labels(field.name, values.shape[1:], index)])] = values[:, *index]
        return pd.DataFrame(columns)


def _labels(name: str, shape: tuple[int, ...], index: tuple[int, ...]) -> list[str]:
    """Return the words for one number of a sample."""
    labels = []
    for axis, (size, at) in enumerate(zip(shape, index, strict=True)):
        if axis == 0 and size == len(_TRIGGERS):
            labels.append(_TRIGGERS[at])
        else:
            known = _AXES.get(name) or (_AXES["_m"] if name.endswith("position_m") else ())
            labels.append(known[at] if at < len(known) else str(at + 1))
    return labels


class Sampler(Listener):
    """Listener that samples the history, and notes the contacts."""

    def __init__(self, run: "Callable[[], Loopback]", scene: "Scene", truth: "TrueContact") -> None:
        """run: returns both sides, once they have been built."""
        self.contacts: list[Contact] = []
        self._run, self._scene, self._truth = run, scene, truth
        self._rows: list[tuple[Any, ...]] = []
        self._tick: events.Tick | None = None
        self._fastest_m_s = math.nan
        self._next_s = -math.inf

    def on_tick(self, tick: events.Tick) -> None:
        """Keep the tick's results until its messages have left."""
        self._tick = tick

    def on_sent(self, now_s: float) -> None:
        """Note a contact, and take a sample each period."""
        held = self._run().robot.held
        if (onset := self._truth.update(held)) is not None:
            self.contacts.append(Contact(now_s, onset.thing, onset.gripper_part, onset.closing_speed_m_s))
            self._fastest_m_s = max(onset.closing_speed_m_s, np.nan_to_num(self._fastest_m_s, nan=-math.inf))
        if now_s >= self._next_s - 1e-9:
            late = now_s - self._next_s >= PERIOD_S  # also before the first sample
            self._next_s = (now_s if late else self._next_s) + PERIOD_S
            self._rows.append(self._row(now_s, held))
            self._fastest_m_s = math.nan

    def history(self) -> History:
        """Return all samples so far."""
        names = [field.name for field in fields(History)]
        columns = zip(*self._rows, strict=True)
        if not self._rows:
            raise ValueError("the episode has no history yet; valid: after arm(), step() or run()")
        return History(**{name: np.array(values) for name, values in zip(names, columns, strict=True)})

    def _row(self, now_s: float, held: str | None) -> tuple[Any, ...]:
        run, data, robot = self._run(), self._scene.data, self._scene.robot
        found = None if self._tick is None else self._tick.found
        device = run.device
        sensed = None if found is None else found.sensed
        strengths, overlap_m3 = np.array(device.strengths, dtype=float), run.robot.figures.overlap_m3
        return (
            now_s,
            found is not None and found.motion_state == "armed",
            data.site_xpos[robot.site].copy(),
            self._truth.approach()[1],
            data.qpos[robot.arm_positions].copy(),
            device.travel,
            strengths,
            tuple(map(float, device.strength)),
            np.full((2, 8), math.nan) if sensed is None else [sensed.l2.fast_m, sensed.r2.fast_m],
            device.rumble.left,
            math.nan if sensed is None else sensed.enlargement_m,
            math.nan if overlap_m3 is None else overlap_m3,
            math.nan if found is None else found.situation.loop_age_s,
            self._truth.gap_m(held),
            self._fastest_m_s,
        )
