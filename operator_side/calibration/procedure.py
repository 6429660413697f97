"""Measure one controller's triggers and sticks step by step, without I/O.

    rest ─▶ pull L2 ─▶ pull R2 ─▶ sticks ─▶ rest again ─▶ done

A second of rest gives the noise, from which the dead zones follow, and the sticks' rest positions. Three full pulls of
each trigger give its saturation. Rest is measured again at the end, as a worn stick returns to another position.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.errors import FeelaheadError
from operator_side.controller.state import ControllerState, Stick
from operator_side.hands.travel_calibration import LARGEST_REST, StickRest, TravelCalibration, TriggerTravel

REST_S: Final = 1.0
_LEAST_REPORTS: Final = 20
_STILL: Final = 0.06
"""Maximum change of a channel within the second of rest; a larger change counts as a motion"""
_CHANNELS: Final = ("L2", "R2", "the left stick", "the left stick", "the right stick", "the right stick")
PULLS: Final = 3
_PULLED, _RELEASED_ABOVE_REST = 0.4, 0.1
_LEAST_PULL: Final = 0.5
_LARGEST_SPREAD: Final = 0.08
"""Maximum difference between a trigger's full pulls, which should all end at the same stop"""
_ATTEMPTS: Final = 3
_LONGEST_WAIT_S: Final = 60.0
_REST_MARGIN: Final = 0.02
"""Travel added to the highest travel at rest for the dead zone: five of a report's 255 steps"""
_PULL_MARGIN: Final = 0.03
"""Travel subtracted from the smallest full pull for the saturation, as noise has raised the pulls"""
_STICK_MARGIN: Final = 0.03
_LEAST_TRIGGER_DEAD_ZONE: Final = 0.03
_LEAST_STICK_DEAD_ZONE: Final = 0.05
_LARGEST_TRIGGER_REST: Final = 0.25
_SECTORS: Final = 8
_STICK_EDGE: Final = 0.7
_ENOUGH_SECTORS: Final = 6


class CalibrationError(FeelaheadError):
    """A controller cannot be calibrated, because of its faults or the way it is handled; the text gives the reason."""


class Step(Enum):
    """Step of the procedure; its value is the instruction for the person."""

    REST = "Put the controller down and touch nothing."
    PULL_L2 = "Pull L2 all the way and let go, three times."
    PULL_R2 = "Pull R2 all the way and let go, three times."
    STICKS = "Move both sticks around their edges once, then let go."
    REST_AGAIN = "Put the controller down again and touch nothing."
    DONE = "Done."


_ORDER: Final = tuple(Step)


@dataclass(frozen=True)
class Rest:
    """Result of the measurement of a second of rest."""

    l2: float
    """Highest raw travel of L2"""
    r2: float
    """Highest raw travel of R2"""
    left: tuple[Stick, float]
    """Mean position of the left stick, and its maximum distance from there"""
    right: tuple[Stick, float]
    """Mean position of the right stick, and its maximum distance from there"""


class RestMeasurement:
    """Measurement of a second of rest, which any motion restarts."""

    def __init__(self) -> None:
        self.result: Rest | None = None
        self.progress = 0.0
        """Share of the second that has passed, 0 to 1."""
        self._since_s = 0.0
        self._reports: list[tuple[float, ...]] = []

    def feed(self, state: ControllerState, now_s: float) -> str | None:
        """Take one state. If a motion restarts the second, return a text that names it; else None."""
        values = (state.l2, state.r2, *state.left_stick, *state.right_stick)
        self._since_s = self._since_s if self._reports else now_s
        self._reports.append(values)
        for name, column in zip(_CHANNELS, zip(*self._reports, strict=True), strict=True):
            if max(column) - min(column) > _STILL:
                self._since_s, self._reports, self.progress = now_s, [values], 0.0
                return f"{name} is being moved"
        self.progress = min((now_s - self._since_s) / REST_S, 1.0)
        if self.progress >= 1.0 and len(self._reports) >= _LEAST_REPORTS:
            self.result = self._measured()
        return None

    def _measured(self) -> Rest:
        l2, r2, *axes = zip(*self._reports, strict=True)
        sticks = []
        for xs, ys in ((axes[0], axes[1]), (axes[2], axes[3])):
            x, y = math.fsum(xs) / len(xs), math.fsum(ys) / len(ys)
            sticks.append(((x, y), max(math.hypot(one - x, other - y) for one, other in zip(xs, ys, strict=True))))
        return Rest(max(l2), max(r2), sticks[0], sticks[1])


class CalibrationProcedure:
    """Calibration of one controller, from the first state to the result."""

    def __init__(self) -> None:
        self.step = Step.REST
        self.complaint: str | None = None
        """Reason why the last attempt did not count; None once an attempt counts."""
        self.result: TravelCalibration | None = None
        self._since_s: float | None = None
        self._rests: list[Rest] = []
        self._rest = RestMeasurement()
        self._peaks: dict[Step, list[float]] = {Step.PULL_L2: [], Step.PULL_R2: []}
        self._pull: float | None = None
        self._attempts = 0
        self._sectors: tuple[set[int], set[int]] = (set(), set())

    @property
    def progress(self) -> float:
        """Share of the present step that is done, 0 to 1."""
        if self.step in self._peaks:
            return len(self._peaks[self.step]) / PULLS
        if self.step is Step.STICKS:
            return min(1.0, min(len(sectors) for sectors in self._sectors) / _ENOUGH_SECTORS)
        return 1.0 if self.step is Step.DONE else self._rest.progress

    def resume(self) -> None:
        """Go on after a loss of the controller: a second of rest begins again, and so does the wait for the step."""
        self._rest, self._since_s = RestMeasurement(), None

    def feed(self, state: ControllerState, now_s: float) -> None:
        """Take one state of the controller; nothing happens after the last step.

        CalibrationError once the calibration has failed.
        """
        if self._since_s is None:
            self._since_s = now_s
        if self.step is Step.DONE:
            return
        if self.step in (Step.REST, Step.REST_AGAIN):
            self._feed_rest(state, now_s)
        elif self.step is Step.STICKS:
            self._feed_sticks(state, now_s)
        else:
            self._feed_pull(state, now_s)
        if self._since_s is not None and now_s - self._since_s > _LONGEST_WAIT_S:
            why = f" ({self.complaint})" if self.complaint is not None else ""
            raise CalibrationError(f"after {_LONGEST_WAIT_S:.0f} s this step was not done: {self.step.value}{why}")

    def _feed_rest(self, state: ControllerState, now_s: float) -> None:
        self.complaint = self._rest.feed(state, now_s)
        if self._rest.result is None:
            return
        rest, self._rest = self._rest.result, RestMeasurement()
        for name, highest in (("L2", rest.l2), ("R2", rest.r2)):
            if highest > _LARGEST_TRIGGER_REST:
                raise CalibrationError(
                    f"{name} rests at {highest:.2f} of its travel, so it is held, stuck or broken; "
                    f"valid: up to {_LARGEST_TRIGGER_REST}"
                )
        self._rests.append(rest)
        if self.step is Step.REST_AGAIN:
            self.result = self._calibration()
        self._next(now_s)

    def _feed_pull(self, state: ControllerState, now_s: float) -> None:
        left = self.step is Step.PULL_L2
        name, other_name = ("L2", "R2") if left else ("R2", "L2")
        raw, other = (state.l2, state.r2) if left else (state.r2, state.l2)
        resting = self._rests[0].l2 if left else self._rests[0].r2
        if other > _PULLED:
            self.complaint = f"{other_name} is pulled; release it and pull {name}"
        if self._pull is None:
            self._pull = raw if raw > max(_PULLED, resting + _RELEASED_ABOVE_REST) else None
        elif raw > resting + _RELEASED_ABOVE_REST:
            self._pull = max(self._pull, raw)
        else:
            self._peaks[self.step].append(self._pull)
            self._pull, self.complaint = None, None
            self._since_s = now_s
        if len(self._peaks[self.step]) == PULLS:
            self._judge_pulls(name, now_s)

    def _judge_pulls(self, name: str, now_s: float) -> None:
        peaks = self._peaks[self.step]
        ends = ", ".join(f"{peak:.2f}" for peak in peaks)
        why = None
        if min(peaks) < _LEAST_PULL:
            why = f"the pulls of {name} ended at {ends}; valid: {_LEAST_PULL} or more"
        elif max(peaks) - min(peaks) > _LARGEST_SPREAD:
            why = f"the pulls of {name} ended at {ends}; valid: within {_LARGEST_SPREAD} of each other"
        if why is None:
            self._next(now_s)
            return
        self._attempts += 1
        if self._attempts == _ATTEMPTS:
            raise CalibrationError(f"{why}; {_ATTEMPTS} attempts failed")
        peaks.clear()
        self.complaint = f"{why}: pull {name} all the way again, three times"

    def _feed_sticks(self, state: ControllerState, now_s: float) -> None:
        for (x, y), sectors in zip((state.left_stick, state.right_stick), self._sectors, strict=True):
            if math.hypot(x, y) > _STICK_EDGE:
                sectors.add(int((math.atan2(y, x) / (2.0 * math.pi) % 1.0) * _SECTORS) % _SECTORS)
        if all(len(sectors) >= _ENOUGH_SECTORS for sectors in self._sectors):
            self._next(now_s)

    def _next(self, now_s: float) -> None:
        self.step = _ORDER[_ORDER.index(self.step) + 1]
        self.complaint, self._pull, self._attempts = None, None, 0
        self._since_s = now_s

    def _calibration(self) -> TravelCalibration:
        """Compute the result; CalibrationError for measurements that no working controller gives."""
        before, after = self._rests
        return TravelCalibration(
            l2=_trigger("L2", max(before.l2, after.l2), self._peaks[Step.PULL_L2]),
            r2=_trigger("R2", max(before.r2, after.r2), self._peaks[Step.PULL_R2]),
            left_stick=_stick("left", before.left, after.left),
            right_stick=_stick("right", before.right, after.right),
        )


def _trigger(name: str, highest_rest: float, peaks: list[float]) -> TriggerTravel:
    dead_zone = round(max(highest_rest + _REST_MARGIN, _LEAST_TRIGGER_DEAD_ZONE), 4)
    saturation = round(min(peaks) - _PULL_MARGIN, 4)
    try:
        return TriggerTravel(dead_zone, saturation)
    except ValueError as error:
        raise CalibrationError(
            f"{name} rests at {highest_rest:.2f} and ends at {min(peaks):.2f}: its travel is too short"
        ) from error


def _stick(name: str, before: tuple[tuple[float, float], float], after: tuple[tuple[float, float], float]) -> StickRest:
    (first, first_noise), (second, second_noise) = before, after
    x, y = 0.5 * (first[0] + second[0]), 0.5 * (first[1] + second[1])
    if math.hypot(x, y) > LARGEST_REST:
        raise CalibrationError(
            f"the {name} stick rests at ({x:.2f}, {y:.2f}), so it is held or broken; valid: at most {LARGEST_REST} from"
            " the centre"
        )
    apart = 0.5 * math.dist(first, second)
    dead_zone = max(apart + max(first_noise, second_noise) + _STICK_MARGIN, _LEAST_STICK_DEAD_ZONE)
    if dead_zone > LARGEST_REST:
        raise CalibrationError(
            f"the {name} stick rested at ({first[0]:.2f}, {first[1]:.2f}) and then at ({second[0]:.2f},"
            f" {second[1]:.2f}), so it is held or worn out; valid: at most {2 * LARGEST_REST:.1f} apart"
        )
    return StickRest(round(x, 4), round(y, 4), round(dead_zone, 4))
