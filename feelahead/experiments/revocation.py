"""How soon a revoked operator is out, and what another one loses by it.

    feelahead try revocation --repeats 20

Real sockets with keys on loopback, in one process: the robot side's, looking at its allow-list as often as the process
does, a victim whose key is revoked at a random moment, and a bystander. Both send and receive at 250 Hz.
"""

import itertools
import random
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common.clock import MonotonicClock
from common.command.command_line import parse_settings
from common.errors import FeelaheadError
from common.realtime.pacing import Pacer, wait_for_turn
from common.realtime.priority import raise_priority
from common.sockets.allow_list import AllowList
from common.sockets.authentication import OperatorKeys, RobotKeys, make_key_pair
from common.sockets.keys import KeyFolder
from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets
from robot_side.main import KEYS_PERIOD_S

_PROGRAM = "feelahead try revocation"
_PERIOD_S = 0.004
_START_LIMIT_S = 10.0
_AFTERWARDS_S = 1.5


@dataclass(frozen=True)
class RevocationSettings:
    """How often it is tried."""

    repeats: Annotated[int, tyro.conf.arg(metavar="N")] = 20
    seed: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.repeats <= 1000:
            raise ValueError(f"--repeats {self.repeats}: valid: 1 to 1000")


@dataclass
class Outcome:
    """Seconds after the key's file was deleted, or of silence."""

    last_accepted_s: float = 0.0
    """The victim's last message that the robot side accepted."""
    last_view_s: float = 0.0
    """The last view message that reached the victim."""
    bystander_view_gap_s: float = 0.0
    """The longest silence in the bystander's view."""
    bystander_control_gap_s: float = 0.0
    """And between its messages that the robot side accepted."""


@dataclass
class _Operator:
    name: bytes
    sockets: OperatorSockets
    accepted_s: list[float] = field(default_factory=list)
    view_s: list[float] = field(default_factory=list)


def revoke_once(folder: KeyFolder, generator: random.Random) -> Outcome:
    """Let two in, throw one out."""
    clock = MonotonicClock()
    robot_public, robot_secret = make_key_pair()
    with ExitStack() as stack:
        robot = stack.enter_context(RobotSockets("tcp://127.0.0.1:0", keys=RobotKeys(robot_secret, AllowList(folder))))
        operators = []
        for name in ("victim", "bystander"):
            public, secret = make_key_pair()
            folder.allow(name, public)
            keys = OperatorKeys(secret, robot_public)
            sockets = OperatorSockets(robot.control_endpoint, robot.view_endpoint, keys=keys)
            operators.append(_Operator(name.encode(), stack.enter_context(sockets)))
        victim, bystander = operators
        raise_priority()  # what else the machine does is not to be measured
        began_s = clock.now()
        pacer, next_keys_s = Pacer(_PERIOD_S, began_s), began_s
        revoke_s: float | None = None
        while revoke_s is None or clock.now() < revoke_s + _AFTERWARDS_S:
            now_s = clock.now()
            if revoke_s is None and all(one.accepted_s and one.view_s for one in operators):
                revoke_s = now_s + generator.uniform(0.2, 0.2 + KEYS_PERIOD_S)
            if revoke_s is None and now_s > began_s + _START_LIMIT_S:
                raise FeelaheadError(f"the operators were not let in within {_START_LIMIT_S:g} s")
            if revoke_s is not None and now_s >= revoke_s and folder.peer_path("victim").exists():
                revoke_s = now_s
                folder.revoke("victim")
            if now_s >= next_keys_s:
                next_keys_s = now_s + KEYS_PERIOD_S
                robot.refresh_keys()
            for _, payload in robot.receive():
                next(one for one in operators if one.name == payload).accepted_s.append(now_s)
            for one in operators:
                one.sockets.receive()
                one.view_s += [now_s for _ in one.sockets.receive_view()]
            if pacer.due(now_s):
                pacer.begin(now_s)
                robot.publish(b"telemetry", b"state")
                for one in operators:
                    one.sockets.send(one.name)
            wait_for_turn(pacer, clock, robot.wait, spin_s=0.0)
        folder.revoke("bystander")
    return Outcome(
        max(0.0, victim.accepted_s[-1] - revoke_s),
        max(0.0, victim.view_s[-1] - revoke_s),
        _longest_gap_s([time_s for time_s in bystander.view_s if time_s > revoke_s - 0.1]),
        _longest_gap_s([time_s for time_s in bystander.accepted_s if time_s > revoke_s - 0.1]),
    )


def _longest_gap_s(times_s: Sequence[float]) -> float:
    return max((after - before for before, after in itertools.pairwise(times_s)), default=_AFTERWARDS_S)


def try_revocation(arguments: Sequence[str]) -> int:
    """Repeat, and print the table."""
    settings = parse_settings(RevocationSettings, _PROGRAM, arguments)
    generator = random.Random(settings.seed)  # noqa: S311  # repeatable, not secret
    outcomes = []
    with tempfile.TemporaryDirectory(prefix="feelahead-") as folder, Progress(transient=True) as progress:
        for _ in progress.track(range(settings.repeats), description="revocations"):
            outcomes.append(revoke_once(KeyFolder(Path(folder)), generator))
    shown = Table(title=f"{settings.repeats} revocations")
    for heading in ("after the revocation", "median, ms", "largest, ms", "goal, ms"):
        shown.add_column(heading, justify="left" if heading.startswith("after") else "right")
    for title, name in (
        ("last command accepted", "last_accepted_s"),
        ("last view message received", "last_view_s"),
        ("silence in another one's view", "bystander_view_gap_s"),
        ("silence in another one's control", "bystander_control_gap_s"),
    ):
        values_ms = sorted(1e3 * getattr(outcome, name) for outcome in outcomes)
        shown.add_row(title, f"{values_ms[len(values_ms) // 2]:.0f}", f"{values_ms[-1]:.0f}", "< 1000")
    Console(width=100 if not sys.stdout.isatty() else None).print(shown)
    return 0
