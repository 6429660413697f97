"""Changes of the probability P and the emulated link during a run: only by the owner, if permitted, and whole."""

from dataclasses import replace

import pytest

from common.protocol.codec import encode
from common.protocol.messages import Header, Tune
from robot_side.enlargement.distance import standard_quantile
from robot_side.operators.tuning import Tuning
from tests.robot_side.session_bench import QUICK, Bench, Operator


@pytest.fixture
def bench() -> Bench:
    return Bench(replace(QUICK, permit_tuning=True))


def tune(
    bench: Bench, operator: Operator, number: int, probability: float | None = None, link: str | None = None
) -> bytes:
    payload = encode(Tune(operator.link.stamp(bench.now_s), number, probability, link))
    bench.robot.receive(operator.peer, payload, bench.now_s)
    return payload


def enlargement_mm(bench: Bench) -> float:
    bench.tick(200)
    # The status says nothing before the loop age is known.
    assert bench.robot.status(bench.now_s).enlargement_mm is None
    assert bench.robot.newest is not None
    return 1e3 * bench.robot.newest[0].enlargement_m


@pytest.mark.parametrize("law", ["swept", "paper"])
def test_the_gripper_is_enlarged_by_the_probability_that_was_tuned(law: str) -> None:
    # Eq. 9-10 at rest: a mean and the quantile's multiple of one deviation, so that three probabilities are on a line.
    bench = Bench(replace(QUICK, permit_tuning=True, law=law))
    owner = bench.join(2)
    probabilities, found = (0.6, 0.9, 0.999), []
    for number, probability in enumerate(probabilities, 1):
        bench.say_hello(owner)
        tune(bench, owner, number, probability)
        found.append(enlargement_mm(bench))
    assert found == sorted(found)
    low, middle, high = (float(standard_quantile(probability)) for probability in probabilities)
    assert (found[2] - found[0]) / (found[1] - found[0]) == pytest.approx((high - low) / (middle - low), rel=0.01)


def test_notices_say_what_is_permitted_what_holds_and_what_was_heard(bench: Bench) -> None:
    owner, observer = bench.join(2), bench.join(3, b"observer")
    assert owner.notice is not None
    assert (owner.notice.may_tune, owner.notice.probability, owner.notice.tuned) == (True, 0.99, 0)
    tune(bench, owner, 5, 0.8)
    bench.tick()
    assert (owner.notice.probability, owner.notice.tuned) == (0.8, 5)
    assert observer.notice is not None
    assert (observer.notice.probability, observer.notice.tuned) == (0.8, 0)


def test_a_wish_that_is_repeated_or_replayed_is_granted_once(bench: Bench) -> None:
    owner = bench.join(2)
    old = tune(bench, owner, 1, 0.7)
    tune(bench, owner, 1, 0.7)
    tune(bench, owner, 2, 0.8)
    bench.robot.receive(owner.peer, old, bench.now_s)
    tuning = bench.robot.session.tuning
    assert tuning.probability == 0.8
    assert [one["probability"] for one in tuning.summary()["granted"]] == [0.7, 0.8]


def test_observers_tune_nothing(bench: Bench) -> None:
    bench.join(2)
    observer = bench.join(3, b"observer")
    tune(bench, observer, 1, 0.5, "delay 100ms")
    tuning = bench.robot.session.tuning
    assert (tuning.probability, tuning.take_link(), tuning.refused) == (0.99, None, 1)
    assert tuning.take_notes() == ["tuning refused: only the owner of the robot may tune"]


def test_without_permission_nothing_is_tuned_and_that_is_said_once() -> None:
    bench = Bench()
    owner = bench.join(2)
    assert owner.notice is not None
    assert not owner.notice.may_tune
    for number in range(1, 4):
        tune(bench, owner, number, 0.5)
    tuning = bench.robot.session.tuning
    assert (tuning.probability, tuning.refused) == (0.99, 3)
    assert tuning.take_notes() == ["tuning refused: the robot side permits it with --permit-tuning only"]
    assert bench.robot.summary()["lease"]["tuning"] == {"permitted": False, "granted": [], "refused": 3}


@pytest.mark.parametrize("link", ["delay 3s", "trace /etc/hostname", "nonsense"])
def test_a_wish_with_a_bad_link_is_refused_whole(bench: Bench, link: str) -> None:
    owner = bench.join(2)
    tune(bench, owner, 1, 0.5, link)
    tuning = bench.robot.session.tuning
    assert (tuning.probability, tuning.take_link(), tuning.refused) == (0.99, None, 1)
    [note] = tuning.take_notes()
    assert "\n" not in note


def test_what_was_tuned_when_is_in_the_summary() -> None:
    asked: list[float] = []
    tuning = Tuning(0.99, asked.append)
    tuning.begin(10.0)
    tuning.begin(11.0)
    assert tuning.grant(Tune(Header(1, 1, 0.0), 1, 0.9, "delay 20ms"), 12.5, owns=True)
    assert asked == [0.9]
    assert tuning.summary()["granted"] == [{"time_s": 2.5, "probability": 0.9, "link": "delay 20ms"}]
    assert (tuning.take_link(), tuning.take_link()) == ("delay 20ms", None)
    assert tuning.take_notes() == ["tuned: P = 0.9, link 'delay 20ms'"]
