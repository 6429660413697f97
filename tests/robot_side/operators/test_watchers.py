import math
from typing import Any

import pytest

from common.protocol.codec import encode
from common.protocol.messages import Watch
from robot_side.operators.watchers import WATCH_S, Watchers
from tests.robot_side.session_bench import Bench, Operator


def watch(bench: Bench, operator: Operator, **what: Any) -> None:
    payload = encode(Watch(operator.link.stamp(bench.now_s), **what))
    bench.robot.receive(operator.peer, payload, bench.now_s)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def looked_at(bench: Bench) -> frozenset[str]:
    return bench.robot.session.watchers.looked_at(bench.now_s)


def test_owner_and_observers_may_look_and_each_watch_lasts_a_second(bench: Bench) -> None:
    owner, observer = bench.join(2, b"one"), bench.join(3, b"two")
    assert looked_at(bench) == frozenset()
    watch(bench, owner, overview=True)
    bench.tick(600)
    watch(bench, observer, scene=True, first_person=True)
    assert looked_at(bench) == {"overview", "first_person", "scene"}
    bench.tick(399)
    assert "overview" in looked_at(bench)
    bench.tick(1)
    assert looked_at(bench) == {"first_person", "scene"}
    bench.tick(600)
    assert looked_at(bench) == frozenset()


def test_an_old_watch_again_counts_for_nothing(bench: Bench) -> None:
    owner = bench.join(2)
    payload = encode(Watch(owner.link.stamp(bench.now_s), overview=True))
    bench.robot.receive(owner.peer, payload, bench.now_s)
    bench.tick(1500)
    bench.robot.receive(owner.peer, payload, bench.now_s)
    assert looked_at(bench) == frozenset()


def test_pictures_are_steps_only_if_all_their_viewers_show_steps() -> None:
    watchers, header = Watchers(), Bench().operator(1).link.stamp(0.0)
    assert watchers.lacks(0.0) is None
    watchers.heard(1, Watch(header, overview=True, lacks=(3, 0)), 0.0)
    watchers.heard(2, Watch(header, first_person=True, lacks=(2, 9)), 0.5)
    watchers.heard(3, Watch(header, scene=True), 0.5)
    assert watchers.lacks(0.6) == (3, 9)
    assert watchers.lacks(WATCH_S) == (2, 9)
    watchers.heard(4, Watch(header, overview=True), 0.6)
    assert watchers.lacks(0.7) is None


def test_no_observer_slows_the_pictures_of_the_operator_who_drives() -> None:
    watchers, header = Watchers(), Bench().operator(1).link.stamp(0.0)
    assert watchers.pace(1, 0.0) == (math.inf, False, math.inf)
    watchers.heard(2, Watch(header, overview=True, picture_hz=0.1, halved=True, scene_hz=0.1), 0.0)
    assert watchers.pace(1, 0.1) == watchers.pace(None, 0.1) == (0.1, True, 0.1)
    watchers.heard(1, Watch(header, overview=True, picture_hz=20.0), 0.1)
    assert watchers.pace(1, 0.2) == (20.0, False, math.inf)
    assert watchers.pace(None, 0.2) == (0.1, True, 0.1)


def test_each_viewer_that_begins_to_look_is_counted_once() -> None:
    watchers = Watchers()
    header = Bench().operator(1).link.stamp(0.0)
    look, away = Watch(header, scene=True), Watch(header)
    for turn in range(5):
        watchers.heard(1, look, 0.25 * turn)
    assert watchers.scene_begun == 1
    watchers.heard(2, look, 1.0)
    assert watchers.scene_begun == 2
    watchers.heard(1, away, 1.1)
    watchers.heard(1, look, 1.2)
    assert watchers.scene_begun == 3
    watchers.heard(1, look, 1.2 + WATCH_S)
    assert watchers.scene_begun == 4
