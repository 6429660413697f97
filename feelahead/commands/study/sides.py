"""Both sides of one trial as processes, with one recorder, and what is heard of them."""

import contextlib
import json
import time
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from common.errors import FeelaheadError
from common.recording.side import RecorderProcess
from common.status.codes import ConnectionState, LinkState
from common.status.statuses import OperatorStatus, RobotStatus
from feelahead.both_sides.processes import SideProcess, flag_of
from feelahead.commands.demo.page import kept_addresses
from feelahead.commands.demo.run import Said, Start
from feelahead.study.room import Seen
from feelahead.study.session import Start as Asked
from feelahead.study.trials.sides import side_values


@dataclass(frozen=True)
class Desk:
    """What all trials share."""

    device: str
    """Device of the operator side"""
    folder: Path
    """Folder for the recorder's socket and the two files below"""
    log: Path
    """File to which a line is added for each failure: it may name a condition, so nobody in the room sees it"""

    @property
    def token(self) -> Path:
        """File with the token of the console's address"""
        return self.folder / "token"

    @property
    def back(self) -> Path:
        """File with the address of the participant's page"""
        return self.folder / "back"

    def note(self, what: str, reason: str) -> None:
        """Add a line to the log, if there is room on the disk."""
        with contextlib.suppress(OSError), self.log.open("a", encoding="utf-8") as file:
            file.write(f"{json.dumps({'what': what, 'reason': reason})}\n")


class TrialSides:
    """Both sides from their start to their end. Only `__init__` and the thread that `close` starts may block."""

    def __init__(self, asked: Asked, desk: Desk, console_port: int) -> None:
        """Start recorder and sides; FeelaheadError if the recorder cannot be started."""
        self._desk, self._seen = desk, Seen()
        values, socket = side_values(asked.planned, asked.condition), desk.folder / f"{asked.recording.stem}.socket"
        self._recorder = RecorderProcess(asked.recording, socket)
        self._said, self._start = Said(), Start(values.robot["link"], time.monotonic())
        with ExitStack() as stack:
            stack.callback(self._recorder.close)
            at = stack.enter_context(kept_addresses("control", "view"))
            shared = [f"--record={socket}"]
            robot = [*shared, f"--bind={at['control']}", f"--view-bind={at['view']}", "--cameras.at-once"]
            robot += [flag_of(name, value) for name, value in values.robot.items()]
            operator = [*shared, f"--connect={at['control']}", f"--view-connect={at['view']}"]
            operator += [f"--device={desk.device}", "--console", f"--console-port={console_port}"]
            operator += [f"--console-token={desk.token}", f"--console-back={desk.back}"]
            operator += [flag_of(name, value) for name, value in values.operator.items()]
            self._sides = [stack.enter_context(SideProcess("robot_side", "robot", robot))]
            self._sides.append(stack.enter_context(SideProcess("operator_side", "operator", operator)))
            self._stack = stack.pop_all()

    @property
    def process_ids(self) -> dict[str, int]:
        """Process ids of both sides and of the recorder, by name"""
        return {side.name: side.process_id for side in self._sides} | {"recorder": self._recorder.process_id}

    def look(self, now_s: float) -> Seen:
        """Take in what was reported since the last call; return what is known now."""
        for side in self._sides:
            for event in side.events():
                self._take(side, event)
            if not side.running and self._seen.failed is None:
                self._fail(f"the {side.name} side was lost", _reason(side))
        if self._seen.failed is None and (error := self._recorder.error()) is not None:
            self._fail("the recorder was lost", error)
        robot, operator = self._said.robot, self._said.operator
        up = operator is not None and operator.link is LinkState.UP
        if not up and self._seen.side == "starting" and (why := self._start.trouble(self._said, now_s)) is not None:
            self._fail("the sides did not start", why)
        lost = None
        if operator is not None:
            if operator.controller is ConnectionState.LOST:
                lost = "the controller was lost"
            elif operator.link is LinkState.LOST:
                lost = "the link was lost"
        self._seen = replace(
            self._seen,
            side="up" if up else "starting" if self._seen.side == "starting" else "not heard",
            controller=None if operator is None or operator.controller is None else operator.controller.value,
            lost=lost,
            armed=robot is not None and robot.state == "armed",
            placed=None if robot is None else robot.placed,
        )
        return self._seen

    def close(self, pool: ThreadPoolExecutor) -> "Future[str | None]":
        """End the sides and finish the recording, in a thread; the result says why the recording is not whole."""
        return pool.submit(self._close)

    def _close(self) -> str | None:
        for side in reversed(self._sides):
            side.interrupt()
        for side in reversed(self._sides):
            side.stop()
        error = self._recorder.finish()["error"]
        if error is not None:
            self._desk.note("recorder", str(error))
        self._stack.close()
        return None if error is None else "the recorder was lost"

    def _take(self, side: SideProcess, event: dict[str, Any]) -> None:
        said = self._said
        match event["event"]:
            case "status" if side.name == "robot":
                said.robot = msgspec.convert(event, RobotStatus)
            case "status":
                said.operator = msgspec.convert(event, OperatorStatus)
            case "listening":
                said.listens = True
            case "console":
                self._seen = replace(self._seen, console=str(event["address"]))
            case _:
                said.notes_of_robot += side.name == "robot"

    def _fail(self, words: str, reason: str) -> None:
        self._seen = replace(self._seen, failed=words)
        self._desk.note(words, reason)


def _reason(side: SideProcess) -> str:
    try:
        side.check()
    except FeelaheadError as error:
        return str(error)
    return "it ended early"
