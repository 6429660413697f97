"""Age of frames from outside: its bounds, objects that are carried on, and errors that grow."""

from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.drivers.remote.objects import RemoteObjects
from robot_side.drivers.remote.sender_clock import UNBOUNDED_S
from robot_side.surroundings.age import MOST_CARRIED_S, MOST_GROWN_S, since
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.surroundings import Surroundings

BALL: dict[str, Any] = {"name": "ball", "sphere": 0.03, "velocity_m_s": [0.2, 0.0, 0.0]}
FLOOR: dict[str, Any] = {"name": "floor", "half_space": True}
UNSEEN_M_S = 0.02
AHEAD_S = 500.0
"""The sender's clock minus the robot side's"""


class Eyes:
    """Sender with a clock of its own, over a way that takes a time each way, in virtual time."""

    def __init__(self, delay_s: float = 0.0, *, echoes: bool = True) -> None:
        self.now_s, self.delay_s, self.echoes = 10.0, delay_s, echoes
        self.notes: list[str] = []
        self._sequence = 0
        self._arriving: list[tuple[bytes, bytes, float]] = []
        self._read: tuple[float, float] | None = None
        self.objects = RemoteObjects(self, {}, self.notes.append, unseen_m_s=UNSEEN_M_S)

    def receive(self) -> list[tuple[bytes, bytes, float]]:
        arrived, self._arriving = self._arriving, []
        return arrived

    def send(self, peer: bytes, payload: bytes) -> bool:
        answer = msgpack.unpackb(payload)
        self._read = (answer["sent_s"], self.now_s + self.delay_s) if "sent_s" in answer else self._read
        return bool(peer)

    def says(self, *things: dict[str, Any], taken_ago_s: float = 0.0, jumps_s: float = 0.0) -> PerceivedObjects:
        """Send a frame now; return it when it has arrived."""
        self._sequence += 1
        here_s = self.now_s + AHEAD_S + jumps_s
        frame: dict[str, Any] = {"version": 1, "sequence": self._sequence, "sent_s": here_s, "objects": things}
        frame["taken_s"] = here_s - taken_ago_s
        if self.echoes:
            echo_s, read_s = (None, self.now_s) if self._read is None else self._read
            frame |= {"echo_s": echo_s, "held_s": self.now_s - read_s}
        self.now_s += self.delay_s
        self._arriving.append((b"eyes", msgpack.packb(frame), self.now_s))
        return self.objects.perceive(self.now_s)

    def after(self, seconds: float) -> PerceivedObjects:
        self.now_s += seconds
        return self.objects.perceive(self.now_s)


def settled(eyes: Eyes, *things: dict[str, Any], **fields: float) -> PerceivedObjects:
    """Send three frames, 0.1 s apart: by the third an answer to the first has been echoed."""
    frame = eyes.says(*things, **fields)
    for _ in range(2):
        eyes.after(0.1)
        frame = eyes.says(*things, **fields)
    return frame


def test_a_frame_without_an_echo_counts_as_older_and_that_is_told_once() -> None:
    eyes = Eyes(echoes=False)
    frame = settled(eyes, FLOOR)
    assert frame.unseen_m == pytest.approx(UNSEEN_M_S * UNBOUNDED_S)
    assert [note for note in eyes.notes if "age of frames is not bounded" in note] == eyes.notes
    assert len(eyes.notes) == 1


def test_an_echo_bounds_the_age_by_the_round_trip() -> None:
    for delay_s in (0.0, 0.02, 0.1):
        eyes = Eyes(delay_s)
        frame = settled(eyes, BALL, taken_ago_s=0.05)
        # The age is known to the time that the answer took: between 0.05 + 0 and 0.05 + both ways.
        assert frame.late_s == pytest.approx(delay_s, abs=0.001)
        assert frame.sphere_centers_m[0, 0] == pytest.approx(0.2 * (0.05 + delay_s), abs=1e-4)
        assert frame.unseen_m == pytest.approx(UNSEEN_M_S * (0.05 + 2.0 * delay_s), abs=0.0006)
        assert eyes.notes == []


def test_a_moving_object_is_carried_on_for_half_a_second_and_then_its_error_grows() -> None:
    eyes = Eyes()
    settled(eyes, BALL, FLOOR)
    table = Surroundings()
    for _ in range(40):
        table.see(frame := eyes.after(0.01))
    assert frame.sphere_centers_m[0, 0] == pytest.approx(0.2 * 0.4, abs=0.002)
    assert table.see(frame).shapes[0, 0] == frame.sphere_centers_m[0, 0]
    assert frame.half_space_offsets_m[0] == 0.0
    assert frame.late_s < 0.01
    frame = eyes.after(0.6)
    assert frame.sphere_centers_m[0, 0] == pytest.approx(0.2 * MOST_CARRIED_S)
    assert frame.late_s == pytest.approx(0.5, abs=0.01)
    assert any("1.0 s old" in note for note in eyes.notes)
    assert eyes.after(100.0).unseen_m == pytest.approx(UNSEEN_M_S * MOST_GROWN_S)


def test_a_resting_scene_is_the_same_frame_until_its_error_has_grown() -> None:
    eyes = Eyes()
    first = settled(eyes, FLOOR)
    frames = [eyes.after(0.004) for _ in range(50)]
    assert len({id(frame) for frame in [first, *frames]}) <= 10
    assert frames[-1].unseen_m == pytest.approx(UNSEEN_M_S * 0.2, abs=0.0006)
    assert frames[-1].half_space_offsets_m is not None


def test_a_clock_that_jumps_costs_one_frame() -> None:
    eyes = Eyes()
    settled(eyes, BALL)
    eyes.after(0.1)
    eyes.says(BALL, jumps_s=-50.0)
    assert eyes.objects.rejected["clock"] == 1
    eyes.after(0.1)
    eyes.says(BALL, jumps_s=-50.0)
    assert eyes.objects.summary() == {"accepted": 4, "clock": 1}


@settings(derandomize=True, deadline=None)
@given(
    age_s=st.floats(0.0, 3.0),
    doubt_s=st.floats(0.0, 1.0),
    true=st.floats(0.0, 1.0),
    speed_m_s=st.floats(0.0, 2.0),
    strays_m_s=st.floats(0.0, UNSEEN_M_S),
)
def test_the_object_is_within_its_error_whenever_the_picture_was_taken(
    age_s: float, doubt_s: float, true: float, speed_m_s: float, strays_m_s: float
) -> None:
    earliest_s, latest_s = -age_s - doubt_s, -age_s
    known = since((earliest_s, latest_s), 0.0, UNSEEN_M_S)
    true_age_s = age_s + true * doubt_s
    moved_m = (speed_m_s + strays_m_s) * true_age_s
    error_m = abs(moved_m - speed_m_s * known.carried_s)
    assert error_m <= speed_m_s * known.late_s + known.unseen_m + 1e-12
    assert np.isfinite(known).all()
