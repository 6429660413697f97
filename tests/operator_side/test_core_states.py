"""Core of the operator side in any order of events: free triggers without stiffness, motion only with the lease.

`Core` has the rules in a few lines, with limits as numbers. In each turn it checks that the operator side follows them.
"""

import math
from typing import Any, cast

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from common.periods import TURN_S
from common.protocol.codec import encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import LeaseNotice, MotionCommand, MotionState
from common.protocol.session import OWNING, SessionState
from operator_side.controller.feel import WARNING_LIGHT, Rumble
from operator_side.controller.state import Button
from tests.operator_side.operator_bench import Bench

REST: dict[str, Any] = {
    "l2": 0.0,
    "r2": 0.0,
    "lateral": (0.0, 0.0),
    "turning": (0.0, 0.0),
    "gripper": 0.0,
    "arm": False,
}
STOPPING = REST | {"run": False, "emergency_stop": True, "next_target": False, "hand_over": False}
PAUSES_S = (0.05, 0.0995, 0.1, 0.1005, 0.15, 0.1995, 0.2, 0.2005, 0.3, 0.4995, 0.5005, 1.0)
GOES_ON = ("lease hands field", "lease hands", "lease hands", "lease field", "hands field", "lease", "")
L1, ARMS, CLOSES = Button.L1, Button.OPTIONS, Button.CROSS
HELD: tuple[frozenset[Button], ...] = (
    *(frozenset({L1}), frozenset({L1, ARMS, CLOSES}), frozenset({L1, ARMS, Button.SQUARE}), frozenset({ARMS})),
    *(frozenset({L1, Button.TRIANGLE, Button.CREATE}), frozenset({L1, ARMS, CLOSES, Button.CIRCLE}), frozenset()),
)
STATES: tuple[MotionState, ...] = ("armed", "armed", "disarmed", "stopped")


def meant(l2: float, r2: float, deflected: bool, held: frozenset[Button]) -> dict[str, Any]:
    """Return the fields of the command that these inputs must give."""
    stop = Button.CIRCLE in held
    lateral, turning = ((1.0, 0.0), (0.0, 1.0)) if deflected else ((0.0, 0.0), (0.0, 0.0))
    return {
        **{"l2": l2, "r2": r2, "lateral": lateral, "turning": turning},
        "gripper": 0.0 if stop else float((Button.CROSS in held) - (Button.SQUARE in held)),
        "run": Button.L1 in held and not stop,
        "arm": Button.OPTIONS in held and not stop,
        "emergency_stop": stop,
        "next_target": Button.TRIANGLE in held and not stop,
        "hand_over": Button.CREATE in held and not stop,
    }


class Core(RuleBasedStateMachine):
    """Operator side, its controller, and a robot side that may send any message at any time."""

    def __init__(self) -> None:
        super().__init__()
        self.bench = Bench()
        self.lease: LeaseNotice | None = None
        self.heard_s = self.bench.now_s
        self.anew_s = -math.inf
        self.field: tuple[float, MotionState, int] | None = None
        self.hands: tuple[float, dict[str, Any]] | None = None
        self.sight, self.blind_s, self.lost_s, self.pressed_s = "seeing", math.nan, math.inf, math.nan
        self.told_s, self.commanded = -math.inf, cast(dict[str, Any] | None, None)
        self.older: list[bytes] = []
        self.held: tuple[tuple[float, float], bool, frozenset[Button]] | None = None
        self.hung, self.waited, self.presses = False, True, 0
        self.take_notice(SessionState.DISARMED, 7)

    @rule(
        seconds=st.sampled_from(PAUSES_S),
        hung=st.booleans(),
        goes_on=st.sampled_from(GOES_ON),
    )
    def pass_time(self, seconds: float, hung: bool, goes_on: str) -> None:
        """Advance time. goes_on: messages and inputs repeated afterwards. hung: no turn before the next event."""
        self.bench.now_s += seconds
        self.hung, self.waited = hung, True
        if "lease" in goes_on and self.lease is not None:
            self.take_notice(self.lease.session, self.lease.token)
        if "hands" in goes_on and self.held is not None:
            self.move_hands(*self.held)
        if "field" in goes_on and self.field is not None:
            self.feel(*self.field[1:])

    @rule(state=st.sampled_from(STATES), r2=st.sampled_from([0, 3, 8]))
    def feel(self, state: MotionState, r2: int) -> None:
        self.look()
        payload = self.bench.stiffness(r2, state)
        self.older.append(payload)
        self.bench.side.receive(payload, self.bench.now_s)
        self.field = (self.bench.now_s, state, r2)
        if self.sight == "blind":
            self.sight = "waiting"
        if state != "armed" and self.bench.now_s > self.lost_s:
            self.lost_s = math.inf

    @rule(session=st.sampled_from([*SessionState, *OWNING, *OWNING]), token=st.integers(1, 3))
    def take_notice(self, session: SessionState, token: int) -> None:
        notice = LeaseNotice(self.bench.robot.stamp(self.bench.now_s), session, "why", token=token, waiting=0)
        self.older.append(encode(notice))
        self.bench.side.receive(self.older[-1], self.bench.now_s)
        if session is SessionState.ENDED:
            anew = self.bench.now_s - self.anew_s < 5.0
            if anew and self.lease is not None and self.lease.session is not SessionState.ENDED:
                return  # about the epoch before
            self.anew_s = self.anew_s if anew else self.bench.now_s
        self.lease, self.heard_s = notice, self.bench.now_s
        if not self.owns:
            self.pressed_s = math.nan
            if self.sight == "blind":
                self.sight = "waiting"

    @rule(data=st.data())
    def hear_something_old(self, data: st.DataObject) -> None:
        """Receive an earlier message again, which must change nothing."""
        if self.older:
            self.bench.side.receive(data.draw(st.sampled_from(self.older)), self.bench.now_s)

    @rule(
        pulls=st.sampled_from([(0.0, 0.0), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0)]),
        deflected=st.booleans(),
        held=st.sampled_from(HELD),
    )
    def move_hands(self, pulls: tuple[float, float], deflected: bool, held: frozenset[Button]) -> None:
        sticks = {"left_stick": (1.0, 0.0), "right_stick": (0.0, 1.0)} if deflected else {}
        self.bench.hands(*held, l2=pulls[0], r2=pulls[1], **sticks)
        self.held = (pulls, deflected, held)
        self.hands = (self.bench.now_s, meant(*pulls, deflected, held))
        if pulls == (0.0, 0.0) and self.sight == "waiting":
            self.sight = "seeing"

    @rule(event=st.sampled_from(["unplugged", "stop pressed on a page", "robot side restarted"]))
    def happen(self, event: str) -> None:
        if event == "unplugged":
            self.bench.side.controller_lost(self.bench.now_s)
            self.hands, self.held, self.lost_s = None, None, self.bench.now_s
        elif event == "stop pressed on a page":
            self.bench.side.press_stop(self.bench.now_s)
            self.presses += math.isnan(self.pressed_s)
            self.pressed_s = self.bench.now_s
        else:
            self.bench.robot = LinkEnd("robot", self.bench.robot.stamp(0.0).epoch + 1, "clock")
            self.bench.side.receive(encode(self.bench.robot.hello(self.bench.now_s)), self.bench.now_s)
            self.lease = None

    @property
    def owns(self) -> bool:
        return self.lease is not None and self.lease.session in OWNING

    def look(self) -> None:
        if self.field is not None and self.bench.now_s - self.field[0] > 0.2:
            self.field = None
            if self.owns and self.sight != "blind":
                self.sight, self.blind_s = "blind", self.bench.now_s

    def expected(self) -> dict[str, Any] | None:
        now_s = self.bench.now_s
        if self.lease is None or not self.owns:
            return None
        if now_s - self.pressed_s >= 0.2 and self.field is not None and self.field[1] == "stopped":
            self.pressed_s = math.nan
        if not math.isnan(self.pressed_s):
            return STOPPING | {"token": self.lease.token}
        if self.hands is None or now_s - self.hands[0] > 0.1:
            return None
        command = self.hands[1]
        if self.lost_s < math.inf and not command["emergency_stop"]:
            return None
        return command | (REST if self.sight != "seeing" else {}) | {"token": self.lease.token}

    @invariant()
    def each_turn(self) -> None:
        """Take a turn of the loop, and compare with the rules."""
        if self.hung:
            self.hung = False
            return
        self.bench.now_s += TURN_S
        self.look()
        if self.bench.now_s - self.heard_s > 0.5:
            self.lease = None
        commands, expected = self.bench.commands(), self.expected()
        leaves = expected is not None and (expected != self.commanded or self.bench.now_s - self.told_s > 0.013)
        assert [fields_of(command) for command in commands] == ([expected] if leaves else [])
        self.told_s, self.commanded = (self.bench.now_s if leaves else self.told_s), expected
        self.bench.write()
        device, seen = self.bench.device, self.field
        if seen is None or seen[1] != "armed":
            assert device.released
        since_s = self.bench.now_s - self.blind_s
        pulses = self.sight == "blind" and since_s < 3.0 and (since_s % 1.0 < 0.12 or 0.24 <= since_s % 1.0 < 0.36)
        if not pulses:
            assert device.rumble == Rumble()
        elif self.waited:  # Otherwise the bound on writes may delay it by a twentieth of a second.
            assert device.rumble != Rumble()
            assert device.commanded.light == WARNING_LIGHT
        self.waited = False
        assert self.bench.side.status(self.bench.now_s).feel == self.sight
        assert (self.bench.side.lease is None) == (self.lease is None)
        assert self.bench.side.commands.stop_button.presses == self.presses


def fields_of(command: MotionCommand) -> dict[str, Any]:
    return {name: getattr(command, name) for name in (*STOPPING, "token")}


TestCore = Core.TestCase
TestCore.settings = settings(max_examples=300, stateful_step_count=50)
