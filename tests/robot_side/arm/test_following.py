"""Judge of an arm that follows or not, with arms of few lines in virtual time, each with its own lag and readings."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.arm.following import Following
from robot_side.arm.limits import JointLimits
from robot_side.arm.port import ArmState

TICK_S = 0.004
JOINTS = 3
DRIVEN_S = 0.2
BEGINS_S = 1.0
LIMITS = JointLimits(np.full(JOINTS, 2.0), np.full(JOINTS, 8.0), np.full(JOINTS, -50.0), np.full(JOINTS, 50.0))
NAMES = ("hip", "knee", "toe")
NOTHING = np.zeros(JOINTS)


@dataclass
class Lagging:
    """Arm whose joints follow what they are told by delay, first-order lag and limit of acceleration."""

    delay_s: float = 0.0
    lag_s: float = 0.0
    acceleration_rad_s2: float = 8.0
    period_s: float = TICK_S
    late_s: float = 0.0
    resolution_rad: float = 0.0
    share: float = 1.0
    """Simulated time as a share of real time"""
    loads_nm: FloatArray | None = field(default_factory=lambda: NOTHING)
    does: Callable[[FloatArray, float], FloatArray] = lambda told, _: told
    """What the joints do of what they are told, at a time"""
    touches: bool = False
    start_rad: float = 0.0
    slides: bool = False
    wraps: bool = False

    def drive(self, commands: FloatArray) -> "Driven":
        sigma_rad = max(2e-4, self.resolution_rad / math.sqrt(12.0))
        following = Following(replace(LIMITS, slides=self.slides), NAMES, sigma_rad)
        driven, random = Driven(following), np.random.default_rng(1)
        under_way, states = deque([NOTHING] * round(self.delay_s / TICK_S)), deque[tuple[float, ArmState]]()
        position, velocity = np.full(JOINTS, self.start_rad), NOTHING
        newest, before, due_s = None, NOTHING, 0.0
        for tick, command in enumerate(commands):
            now_s = tick * TICK_S
            while states and states[0][0] <= now_s:
                newest = states.popleft()[1]
            if newest is not None:
                following.update(before, newest, now_s - newest.time_s, lambda _: self.touches)
                driven.note(now_s)
            before = command
            under_way.append(command)
            wanted = self.does(under_way.popleft(), now_s)
            step_s = self.share * TICK_S
            if self.lag_s:
                wanted = velocity + (wanted - velocity) * min(1.0, step_s / self.lag_s)
            most = self.acceleration_rad_s2 * step_s
            velocity = velocity + np.clip(wanted - velocity, -most, most)
            position = position + step_s * velocity
            if now_s + TICK_S >= due_s:
                due_s += self.period_s
                read = position + random.normal(0.0, 2e-4, JOINTS)
                if self.wraps:
                    read = np.remainder(read, 2.0 * math.pi)
                if self.resolution_rad:
                    read = np.rint(read / self.resolution_rad) * self.resolution_rad
                at_s = now_s + TICK_S
                state = ArmState(at_s, read, velocity, np.empty(0), 0.0, False, self.loads_nm, self.share * at_s)
                states.append((at_s + self.late_s, state))
        return driven


@dataclass
class Driven:
    following: Following
    said: list[tuple[float, str]] = field(default_factory=list)
    stops: list[tuple[float, str]] = field(default_factory=list)

    def note(self, now_s: float) -> None:
        for text, notes in ((self.following.text, self.said), (self.following.stop, self.stops)):
            if text is not None and (not notes or notes[-1][1] != text):
                notes.append((now_s, text))


def steady(*velocity: float, seconds: float = 2.0) -> FloatArray:
    commands = np.tile(np.array(velocity), (round(seconds / TICK_S), 1))
    commands[: round(DRIVEN_S / TICK_S)] = 0.0
    return commands


def by_a_person(seed: int, fastest: float) -> FloatArray:
    """Return commands that start, stop, turn back and change at random, at once or gently."""
    random, last, rows = np.random.default_rng(seed), NOTHING, list[FloatArray]()
    while len(rows) < 8.0 / TICK_S:
        wanted = random.choice([0.0, 1.0, 1.0]) * random.uniform(-fastest, fastest, JOINTS)
        wanted = -last if random.uniform() < 0.2 else wanted
        most = random.choice([math.inf, 3.0 * TICK_S])
        for _ in range(round(random.uniform(0.05, 1.0) / TICK_S)):
            last = last + np.clip(wanted - last, -most, most)
            rows.append(last)
    return np.array(rows)


ARMS = {
    "simulated": Lagging(),
    "of few readings": Lagging(resolution_rad=0.02),
    "slow physics": Lagging(share=0.1),
    "of wrapped readings": Lagging(wraps=True),
    "like a Franka": Lagging(delay_s=0.004, lag_s=0.02, period_s=0.012, late_s=0.004),
    "like a UR": Lagging(delay_s=0.02, lag_s=0.05, period_s=0.008, late_s=0.004, loads_nm=None),
    "like an SO-101": Lagging(0.04, 0.1, 20.0, 0.032, 0.02, 1.5e-3, loads_nm=None),
    "of half the acceleration": Lagging(acceleration_rad_s2=4.0),
    "a tenth too slow": Lagging(does=lambda told, _: 0.9 * told),
}


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())
@pytest.mark.parametrize("fastest", [0.05, 0.3, 1.0])
def test_an_arm_that_follows_in_its_way_is_never_noticed(arm: Lagging, fastest: float) -> None:
    for seed in range(4):
        assert arm.drive(by_a_person(seed, fastest)).said == []


KNEE = "joint 2 (knee)"
FAULTS: dict[str, tuple[Callable[[FloatArray, float], FloatArray], str, bool]] = {
    "servo off": (lambda told, _: told * [1, 0, 1], f"{KNEE} does not move", True),
    "no command": (lambda told, _: 0.0 * told, "joint 1 (hip) and 1 more do not move", True),
    "at 6 %": (lambda told, _: told * [1, 0.06, 1], f"{KNEE} does not move", True),
    "at 50 %": (lambda told, _: told * [1, 0.5, 1], f"{KNEE} moves too slowly", False),
    "at 200 %": (lambda told, _: told * [1, 2, 1], f"{KNEE} moves too far", True),
    "turned round": (lambda told, _: told * [1, -1, 1], f"{KNEE} moves otherwise than commanded", True),
    "jammed later": (lambda told, at: told * [1, at < BEGINS_S, 1], f"{KNEE} does not move", True),
    "by itself": (
        lambda told, at: told + np.array([0, 0, 0.2]) * (at > BEGINS_S),
        "joint 3 (toe) moves otherwise than commanded",
        True,
    ),
}


@pytest.mark.parametrize("of", ["simulated", "like an SO-101", "of half the acceleration"])
@pytest.mark.parametrize(("does", "says", "stops"), FAULTS.values(), ids=FAULTS.keys())
def test_a_joint_that_does_not_follow_is_noticed_within_half_a_second(
    of: str, does: Callable[[FloatArray, float], FloatArray], says: str, stops: bool
) -> None:
    begins_s = BEGINS_S if (does(np.ones(JOINTS), 0.0) == 1.0).all() else DRIVEN_S
    for knee_rad_s in (0.4, -1.2):
        driven = replace(ARMS[of], does=does).drive(steady(0.3, knee_rad_s, 0.0))
        assert says in [text for at_s, text in driven.said if at_s <= begins_s + 0.5]
        assert [begins_s + 0.2 < at_s < begins_s + 1.1 for at_s, _ in driven.stops[:1]] == [True] * stops
        assert all(says.split(")", maxsplit=1)[0] in text or says.startswith("joint 1") for _, text in driven.stops)
        assert set(driven.following.summary()["noticed"]) >= {
            says.split(" moves", maxsplit=1)[0].split(" does", maxsplit=1)[0].split(" and", maxsplit=1)[0]
        }
        errors_rad_s = driven.following.errors_rad_s
        assert errors_rad_s is not None
        assert np.abs(errors_rad_s).max() > 0.15


@pytest.mark.parametrize("slides", [False, True])
@pytest.mark.parametrize("rad_s", [0.005, 0.02, 0.04, 0.1])
def test_a_joint_that_is_driven_gently_or_sinks_is_noticed_by_the_way_and_stops(rad_s: float, slides: bool) -> None:
    speed = 0.2 * rad_s if slides else rad_s
    arm, seconds = Lagging(slides=slides), 2.0 + 0.03 / rad_s
    driven = replace(arm, does=lambda told, _: told * [1, 0, 1]).drive(steady(speed, speed, 0.0, seconds=seconds))
    (said_s, says), (stops_s, _) = driven.said[0], driven.stops[0]
    assert says == f"{KNEE} does not move"
    assert said_s < DRIVEN_S + max(0.5, 0.25 + 0.03 / rad_s)
    assert stops_s < said_s + 0.6
    if rad_s >= 0.04:
        sinks = replace(arm, does=lambda told, _: told - [0.0, speed, 0.0]).drive(steady(speed, 0.0, 0.0, seconds=4.0))
        assert {text for _, text in sinks.said + sinks.stops} == {f"{KNEE} moves otherwise than commanded"}
        assert sinks.stops[0][0] < 0.7 + 0.03 / rad_s


def stands(told: FloatArray, at_s: float) -> FloatArray:
    return told * [1.0, at_s < BEGINS_S, 1.0]


def pushed(told: FloatArray, at_s: float) -> FloatArray:
    return told - [0.0, 0.3 * (at_s > BEGINS_S), 0.0]


@pytest.mark.parametrize("period_s", [TICK_S, 1.0 / 30.0])
@pytest.mark.parametrize(
    ("does", "knee_rad_s", "loads_nm", "noise_nm", "held"),
    # A drive that is held up presses on, and a pushed one resists. One without current does neither, and bears nothing.
    [
        *((stands, 0.5, loads_nm, 0.0, loads_nm[1] > 0.0) for loads_nm in ((0, 5), (-2, 2), (0, -5), (2, 0), (-2, 0))),
        *((stands, -0.5, loads_nm, 0.0, loads_nm[1] < 0.0) for loads_nm in ((0.3, 0), (2, -1))),
        *((stands, 0.5, (1, 1), noise_nm, False) for noise_nm in (0.2, 0.3, 1.0)),
        (stands, 0.5, (0, 5), 0.3, True),
        *((pushed, 0.0, loads_nm, 0.0, loads_nm[1] > 0.0) for loads_nm in ((0, 5), (0, -5), (-2, 0))),
    ],
)
def test_what_something_near_holds_or_pushes_is_said_but_stops_nothing(
    does: Callable[[FloatArray, float], FloatArray],
    knee_rad_s: float,
    loads_nm: tuple[float, float],
    noise_nm: float,
    held: bool,
    period_s: float,
) -> None:
    for near in (True, False):
        measured_nm, random = np.zeros(JOINTS), np.random.default_rng(3)

        def loaded(told: FloatArray, at_s: float) -> FloatArray:
            measured_nm[1] = random.normal(loads_nm[int(at_s > BEGINS_S)], noise_nm)  # noqa: B023
            return does(told, at_s)

        arm = Lagging(does=loaded, loads_nm=measured_nm, touches=near, period_s=period_s)
        driven = arm.drive(steady(0.3, knee_rad_s, 0.0, seconds=4.0))
        if near and held:
            assert driven.said[-1][1] == f"something holds or pushes {KNEE}"
            assert driven.stops == []
            assert driven.following.errors_rad_s is None or not driven.following.errors_rad_s.any()
        else:
            # What presses against nothing that is perceived may be a brake.
            assert all(KNEE in text and "holds" not in text for _, text in driven.said)
            assert driven.stops[0][0] < BEGINS_S + (2.7 if held else 1.2)
            assert driven.following.summary() == {"noticed": {KNEE: 1}, "held": 0}
    # Without loads only the stop is left out where the joint may touch something.
    driven = Lagging(does=does, loads_nm=None, touches=held).drive(steady(0.3, knee_rad_s, 0.0))
    assert (driven.stops == []) is held
    assert driven.following.summary() == {"noticed": {KNEE: 1}, "held": 0}


def test_a_joint_may_stand_at_its_end_and_catch_up_after_it_was_behind() -> None:
    at_end = Lagging(does=lambda told, _: told * [1, 0, 1], start_rad=49.95)
    assert at_end.drive(steady(0.0, 0.3, 0.0)).said == []
    assert at_end.drive(steady(0.0, -0.3, 0.0)).stops != []
    springs = Lagging(does=lambda told, at: told * [1, 0.0 if at < 0.5 else 2.0 if at < 0.6 else 1.0, 1])
    said = [text for _, text in springs.drive(steady(0.0, 0.3, 0.0)).said]
    assert set(said) <= {f"{KNEE} does not move", f"{KNEE} moves too slowly"}


def test_after_a_gap_and_after_a_restart_it_begins_anew() -> None:
    following = Following(LIMITS)

    def said(position_rad: float, *times_s: float) -> str | None:
        for time_s in times_s:
            state = ArmState(time_s, np.full(JOINTS, position_rad), NOTHING, np.empty(0), 0.0, False, NOTHING)
            following.update(None, state, 0.0, lambda _: False)
        return following.text

    assert said(0.0, 0.0, 0.004) is None
    assert said(1.0, 0.008) == "joint 1 and 2 more move otherwise than commanded"
    assert said(1.0, 0.008) is not None
    following.restart()
    assert said(2.0, 0.012, 0.016) is None
    assert said(3.0, 0.2, 0.204) is None
