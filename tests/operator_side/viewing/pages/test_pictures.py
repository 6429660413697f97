import re
from collections.abc import Callable
from itertools import pairwise
from typing import Any, Final

import msgspec
import numpy as np
import pytest

from common.emulation.delay_line import DelayLine
from common.emulation.spec import LinkSpec, Stream
from common.protocol.codec import decode_view, encode
from common.protocol.view_messages import VIEW_NAMES, VideoFrame, VideoStep
from operator_side.viewing.facts import PictureState
from operator_side.viewing.pages.pictures import FIRST, Pictures, dead_after_s, old_after_s
from tests.helpers.messages import telemetry, uniform_update
from tests.operator_side.operator_bench import Bench
from tests.operator_side.viewing.pages.test_browser_hands import Desk

TICK_S, INTERVAL_S = 0.01, 0.05
STREAMS: Final[tuple[Stream, Stream]] = "haptics", "video"
Delay = Callable[[float], float | None]
"""Delay of a picture captured at a time, in seconds; None if it never comes"""


def test_the_limits_are_the_sum_of_what_is_known_of_the_link() -> None:
    known = {"control_p95_s": 0.12, "video_later_s": 0.03, "size_bytes": 25_000, "interval_s": 0.05}
    assert old_after_s(**known, rate_bit_s=2e6) == pytest.approx(0.12 + 0.03 + 0.1 + 0.1 + 0.1)
    assert old_after_s(**known, rate_bit_s=None) == pytest.approx(0.35)
    assert dead_after_s(0.05) == 0.5
    assert dead_after_s(0.4) == pytest.approx(1.2)


class Watched:
    """Operator side that is sent pictures of both views 20 times a second, and control messages 100 times."""

    def __init__(self, control_s: float, video: Delay) -> None:
        self.bench, self.pictures = Bench(), Pictures()
        self._control_s, self._video = control_s, video
        self._under_way: list[tuple[float, bytes]] = []
        self._captured_s = self.start_s = self.bench.now_s
        self.shown: Delay | None = None
        """Delay of the picture that the page shows, if it says so"""
        self.speed_m_s: float | None = None
        """Speed of the tool in the telemetry; None for no telemetry"""

    @property
    def passed_s(self) -> float:
        return self.bench.now_s - self.start_s

    def let_pass(self, for_s: float) -> list[float]:
        shares, bench = [], self.bench
        for _ in range(round(for_s / TICK_S)):
            bench.now_s += TICK_S
            bench.side.receive(encode(uniform_update(bench.robot.stamp(bench.now_s - self._control_s))), bench.now_s)
            while self._captured_s + INTERVAL_S <= bench.now_s:
                self._captured_s += INTERVAL_S
                if (delay_s := self._video(self._captured_s - self.start_s)) is not None:
                    for view in VIEW_NAMES:
                        frame = VideoFrame(bench.robot.stamp(self._captured_s), view, self._captured_s, 8, 8, bytes(99))
                        self._under_way.append((self._captured_s + delay_s, encode(frame)))
            for due_s, payload in self._under_way:
                if due_s <= bench.now_s:
                    self.pictures.receive(payload, bench.now_s)
            self._under_way = [one for one in self._under_way if one[0] > bench.now_s]
            shown = None if self.shown is None else self.shown(bench.now_s)
            if self.speed_m_s is not None:
                told = telemetry(bench.robot.stamp(bench.now_s), tool_speed_m_s=self.speed_m_s)
                bench.side.receive_view(encode(told), bench.now_s)
            self.pictures.update(bench.side, None if shown is None else bench.now_s - shown, bench.now_s)
            shares.append(self.pictures.hands)
        return shares


@pytest.mark.parametrize("delay_s", [0.0, 0.15, 0.3, 1.0])
def test_pictures_as_late_as_the_link_are_not_old(delay_s: float) -> None:
    watched = Watched(delay_s, lambda _: delay_s + 0.02)
    watched.let_pass(2.0 + delay_s)
    assert set(watched.let_pass(3.0)) == {1.0}
    assert watched.pictures.facts().old_s[0] == pytest.approx(delay_s + 2 * INTERVAL_S + 0.1, abs=0.005)


@pytest.mark.parametrize("control_s", [0.0, 0.3])
def test_within_a_second_of_an_outage_the_hands_are_off_without_a_jump_and_return_by_themselves(
    control_s: float,
) -> None:
    watched = Watched(control_s, lambda at_s: None if 3.0 <= at_s < 8.0 else control_s)
    assert watched.let_pass(3.0 + control_s)[-1] == 1.0
    old_after_s = watched.pictures.facts().old_s[VIEW_NAMES.index(FIRST)]
    assert old_after_s is not None
    fading = watched.let_pass(old_after_s - control_s + 1.0)
    assert fading[-1] == 0.0
    assert max(before - after for before, after in pairwise(fading)) < 0.03
    assert set(watched.let_pass(8.0 - watched.passed_s)) == {0.0}
    assert watched.let_pass(control_s + 1.5)[-1] == 1.0


def test_a_queue_of_pictures_alone_is_not_excused() -> None:
    """Pictures come at their rate, each later than the one before; control messages stay fast."""
    watched = Watched(0.02, lambda at_s: 0.02 + 0.3 * at_s)
    assert watched.let_pass(0.4)[-1] == 1.0
    assert watched.let_pass(3.0)[-1] == 0.0


def test_a_page_that_shows_them_late_counts_as_old_too() -> None:
    watched = Watched(0.02, lambda _: 0.02)
    watched.shown = lambda _: 0.1
    assert watched.let_pass(2.0)[-1] == 1.0
    watched.shown = lambda _: 2.0
    assert watched.let_pass(1.5)[-1] == 0.0
    watched.shown = lambda _: -9.0  # a page cannot show what has not come
    assert watched.let_pass(1.5)[-1] == 1.0


@pytest.mark.parametrize("delay_s", [0.0, 0.02, 0.1, 0.3])
def test_pictures_that_come_once_a_second_are_old_and_never_fresh_though_they_come_in_time(delay_s: float) -> None:
    watched = Watched(delay_s, lambda at_s: delay_s if round(at_s / INTERVAL_S) % 20 == 0 else None)
    watched.let_pass(15.0)
    states = set()
    for _ in range(500):
        watched.let_pass(TICK_S)
        states.add(watched.pictures.facts().states[VIEW_NAMES.index(FIRST)])
    assert states == {PictureState.OLD}


def test_another_clock_of_a_robot_side_started_anew_is_followed_and_what_is_broken_passed_over() -> None:
    pictures, bench = Pictures(), Bench()
    for captured_s in (500.0, 500.05, 3.0, 3.05):
        payload = encode(VideoFrame(bench.robot.stamp(1.0), FIRST, captured_s, 8, 8, b"1"))
        for one in (payload, payload[:-1], b""):
            pictures.receive(one, captured_s)
    pictures.update(bench.side, None, 3.06)
    assert pictures.facts().dead_s[0] == 0.5
    assert pictures.hands == 1.0
    for now_s in (3.5, 3.75, 4.0):
        pictures.update(bench.side, None, now_s)
    assert pictures.hands < 1.0


def test_hands_are_scaled_and_hold_to_run_stays_the_persons() -> None:
    desk = Desk()
    desk.arm()
    for counts in (1.0, 0.5, 0.0):
        desk.pages.pictures.hands = counts
        moved: dict[str, Any] = {"r2": 0.8, "lateral": (0.4, -0.2), "turning": (0.0, 1.0), "gripper": 1}
        meant = desk.let_pass(0.1, run=True, **moved)[-1]
        assert meant.run
        assert (meant.r2, *meant.lateral, *meant.turning) == pytest.approx(
            tuple(counts * value for value in (0.8, 0.4, -0.2, 0.0, 1.0))
        )
        assert meant.gripper == (1 if counts == 1.0 else 0)
    assert msgspec.to_builtins(desk.pages.facts(Bench().side, desk.now_s, person=False))["counts"] == 0.0


def test_hands_fade_only_where_old_pictures_hide_motion_and_the_words_have_the_numbers() -> None:
    """20 mm: at 10 mm/s that takes two seconds. Hands that have begun to fade return only with fresh pictures."""
    watched = Watched(0.0, lambda at_s: 0.02 + 0.9 * max(0.0, at_s - 3.0))
    watched.speed_m_s = 0.01
    assert set(watched.let_pass(7.0)) == {1.0}
    assert watched.pictures.facts().states == (PictureState.OLD,) * 2
    assert watched.let_pass(1.0)[-1] == 0.0
    found = re.fullmatch(r"pictures are (\d+) ms old, which hid (\d+) mm of motion", watched.pictures.because)
    assert found is not None
    assert 2300 <= int(found[1]) < 2500
    assert int(found[2]) == 20
    watched.speed_m_s = 0.0
    assert watched.let_pass(1.0)[-1] == 0.0


def test_hands_fade_at_rest_too_once_no_picture_comes() -> None:
    """What begins to move then would go its whole way unseen."""
    watched = Watched(0.0, lambda at_s: None if at_s >= 3.0 else 0.0)
    watched.speed_m_s = 0.0
    assert set(watched.let_pass(3.4)) == {1.0}
    assert watched.let_pass(1.2)[-1] == 0.0
    assert re.fullmatch(r"no new picture has come for 1\.\d s", watched.pictures.because)


@pytest.mark.parametrize("slow_s", [0.0, 0.06, 0.11], ids=["a quick machine", "a slow one", "one about the limit"])
@pytest.mark.parametrize("link", ["", "delay 300ms", "wifi", "lte", "delay 40ms loss 20%"])
def test_a_state_stays_while_the_link_does(link: str, slow_s: float) -> None:
    """At most one change in 30 s over emulated links, however the time of drawing and showing a picture varies."""
    spec, generator = LinkSpec.parse(link, 1), np.random.default_rng(1)
    control, video = (DelayLine[bytes](spec.profile("to_operator", stream)) for stream in STREAMS)
    bench, pictures, states = Bench(), Pictures(), []
    waiting: dict[str, list[tuple[float, float]]] = {"drawn": [], "shown": []}
    shown_s, start_s = None, bench.now_s
    for turn in range(10_000):
        bench.now_s += 0.004
        now_s = bench.now_s
        if turn % 4 == 0:
            control.push(now_s, encode(uniform_update(bench.robot.stamp(now_s))))
        if turn % 17 == 0:  # every 68 ms
            waiting["drawn"].append((now_s + _taken_s(slow_s, generator), now_s))
        for captured_s in _due(waiting["drawn"], now_s):
            stamp = bench.robot.stamp(now_s)
            video.push(now_s, encode(VideoFrame(stamp, FIRST, captured_s, 320, 240, bytes(2000))))
        for payload in control.pop(now_s):
            bench.side.receive(payload, now_s)
        for payload in video.pop(now_s):
            pictures.receive(payload, now_s)
            frame = decode_view(payload)
            assert isinstance(frame, VideoFrame)
            waiting["shown"].append((now_s + _taken_s(slow_s, generator), frame.captured_s))
        shown_s = max([*_due(waiting["shown"], now_s), *([] if shown_s is None else [shown_s])], default=None)
        pictures.update(bench.side, shown_s, now_s)
        if now_s - start_s > 10.0:
            states.append(pictures.facts().states[VIEW_NAMES.index(FIRST)])
    assert sum(before is not after for before, after in pairwise(states)) <= 1
    assert states[-1] is PictureState.FRESH


def _taken_s(mean_s: float, generator: np.random.Generator) -> float:
    """Return a time of a busy machine: its median is `mean_s`, and one in seven takes twice as long or longer."""
    return 0.01 + mean_s * float(generator.lognormal(0.0, 0.65))


def _due(waiting: list[tuple[float, float]], now_s: float) -> list[float]:
    due = [captured_s for due_s, captured_s in waiting if due_s <= now_s]
    waiting[:] = [one for one in waiting if one[0] > now_s]
    return due


def test_steps_that_cannot_be_shown_are_no_pictures() -> None:
    """One is lost: the steps after it come, but nothing new is seen until the next whole picture."""
    bench, pictures = Bench(), Pictures()

    def come(numbers: range) -> PictureState:
        for number in numbers:
            bench.now_s += INTERVAL_S
            stamp = bench.robot.stamp(bench.now_s)
            bench.side.receive(encode(uniform_update(bench.robot.stamp(bench.now_s))), bench.now_s)
            step = VideoStep(stamp, FIRST, bench.now_s, 8, 8, number, number in (1, 80), b"step")
            pictures.receive(encode(step), bench.now_s)
            pictures.update(bench.side, None, bench.now_s)
        return pictures.facts().states[VIEW_NAMES.index(FIRST)]

    assert come(range(1, 40)) is PictureState.FRESH
    assert come(range(41, 80)) is PictureState.DEAD
    assert come(range(80, 110)) is PictureState.FRESH
