"""Run a trial: both sides over the wide area for some seconds, if asked with an observer or a page."""

import contextlib
import os
import signal
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from feelahead.both_sides.processes import SideProcess
from feelahead.both_sides.summary import read_summary
from feelahead.lab.table import Row
from tests.helpers.machines.waiting import LIMIT_S
from tests.two_hosts.wide_area.forwarder import ADDRESSES
from tests.two_hosts.wide_area.trial import Trial
from tests.two_hosts.wide_area.tunnels import Child, Host, WideArea

_ENDPOINT: Final = f"{ADDRESSES['robot']}:5555"
_DEVICES: Final = {"drives": "simulated", "rests": "browser"}


def run_trial(trial: Trial, seed: int = 0) -> Row:
    """Run a trial; return its figures. FeelaheadError if no wide area is possible here, or a side fails."""
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="feelahead-wide-")))
        wide = stack.enter_context(WideArea(trial.ways(), trial.control, seed))
        sides = _Sides(stack, wide, trial, folder, seed)
        sides.start()
        total = sides.watch()
        # The robot side first: the operator side's end would be one more stop.
        codes = sides.robot.stop(LIMIT_S), sides.operator.stop(LIMIT_S)
        assert codes == (0, 0), f"the sides ended with codes {codes}"
        robot, operator = (read_summary(folder / f"{host}.json") for host in ("robot", "operator"))
        return sides.row(total, robot, operator)


@dataclass
class _Sides:
    stack: contextlib.ExitStack
    wide: WideArea
    trial: Trial
    folder: Path
    seed: int
    statuses: int = 0
    """Number of the robot side's statuses since the arm was first armed"""
    armed: int = 0
    armed_after_s: float | None = None
    beside: dict[str, float] = field(default_factory=dict)
    """Figures of the page"""

    def start(self) -> None:
        """Start all processes of the trial; return after the operator side's first status."""
        trial = self.trial
        cameras = () if trial.pictures else ("--no-cameras",)
        self.robot = self._side("robot", "robot", f"--bind=tcp://{_ENDPOINT}", "--insecure", *cameras)
        self.robot.wait_for("listening", LIMIT_S)
        self.wide.figures()
        self.operator = self._operator("operator", *(["--console"] if trial.pictures else ()))
        # The second operator observes.
        self.observer = self._operator("observer") if trial.observer != "none" else None
        self.page: Child | None = None
        if trial.pictures:
            address = self.operator.wait_for("console", LIMIT_S)["address"]
            self.page = self._child("operator", "page", address)

    def _side(self, host: Host, name: str, *arguments: str) -> SideProcess:
        kept = (f"--seed={self.seed}", f"--summary={self.folder / name}.json")
        side = SideProcess(f"{host}_side", name, [*arguments, *kept], self.wide.surroundings(host))
        return self.stack.enter_context(side)

    def _operator(self, name: str, *more: str) -> SideProcess:
        """Start an operator side and wait for its first status."""
        connections = (f"--connections={self.trial.connections}",) if self.trial.connections else ()
        device = f"--device={_DEVICES[self.trial.person]}"
        side = self._side("operator", name, f"--connect=tcp://{_ENDPOINT}", device, *connections, *more)
        side.wait_for("status", LIMIT_S)
        return side

    def _child(self, host: Host, *words: str) -> Child:
        return self.stack.enter_context(self.wide.run(host, *words))

    def watch(self) -> Mapping[str, Any]:
        trial = self.trial
        began_s = time.monotonic()
        for of_all in (1 / 3, 1.0):
            while (passed_s := time.monotonic() - began_s) < of_all * trial.seconds:
                time.sleep(0.05)
                self._listen(passed_s)
            if of_all == 1 / 3 and trial.observer == "stops" and self.observer is not None:
                self.stack.callback(os.kill, self.observer.process_id, signal.SIGCONT)
                os.kill(self.observer.process_id, signal.SIGSTOP)
        total = self.wide.figures()
        if self.page is not None:
            self.beside |= self.page.last()
        return total

    def _listen(self, passed_s: float) -> None:
        for side in (self.robot, self.operator, self.observer):
            for event in () if side is None else side.events():
                if side is self.robot and event["event"] == "status":
                    armed = event["state"] == "armed"
                    if armed and self.armed_after_s is None:
                        self.armed_after_s = passed_s
                    self.statuses += self.armed_after_s is not None
                    self.armed += armed
            if side is not None:
                side.check()

    def row(self, total: Mapping[str, Any], robot: Mapping[str, Any], operator: Mapping[str, Any]) -> Row:
        """Return the trial's figures, from both summaries, the statuses and the counts; None for unmeasured ones.

        Ages are those of applied messages: at the operator on arrival, at the robot in each tick that moves the arm.
        A message that a newer one overtook counts in `slowest_...` only. `armed` is a share of the statuses.
        """
        row: Row = {}
        for way, summary in (("to_operator", operator), ("to_robot", robot)):
            row |= {f"{way}_{name}_ms": summary["applied_age_ms"][way][name] for name in ("p50", "p95", "p99")}
            row[f"slowest_{way}_ms"] = summary["delay_ms"][way]["p99"]
            row[f"{way}_gaps_min"] = 60.0 * summary["gaps"][way] / total["seconds"]
            row[f"{way}_kbit_s"] = 8e-3 * total[way]["bytes"] / total["seconds"]
            row[f"{way}_packets_s"] = total[way]["packets"] / total["seconds"]
        age_ms = row["to_operator_p95_ms"]
        return row | {
            "queueing_p95_ms": None if age_ms is None else age_ms - self.trial.delay,
            "link_queue_p95_ms": total["to_operator"]["queue_p95_ms"],
            "armed": self.armed / max(self.statuses, 1),
            "armed_after_s": self.armed_after_s,
            "stops": len(robot["stops"]),
            "why": "; ".join(dict.fromkeys(stop["reason"] for stop in robot["stops"])),
            "done": robot["task"]["placing"]["placed"],
            **{name: total["to_operator"][name] + total["to_robot"][name] for name in ("lost", "dropped")},
            **self.beside,
            **{name: total[name] for name in ("late_p99_ms", "late_max_ms", "realtime")},
        }
