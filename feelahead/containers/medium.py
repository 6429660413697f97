"""Run trials in containers: the sides are in separate networks, and the router between them emulates the link."""

import json
import shlex
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from typing import Any, Final

from common.emulation.spec import Direction
from feelahead.both_sides.processes import StartedSide
from feelahead.both_sides.real_time import START_S, run_for
from feelahead.both_sides.summary import merge_summaries
from feelahead.both_sides.trial import Trial, figures_of
from feelahead.containers.engine import Engine
from feelahead.containers.netem import Counted, count_packets

PROJECT: Final = "feelahead-latency"
"""Prefix of the compose projects' names; each link has its own project."""
_BUILD_LIMIT_S: Final = 1500.0
_SIDES: Final = ("robot", "operator")


class ContainerMedium:
    """Runs trials in containers. Two networks and a router are kept for each link; both sides are new in each trial."""

    def __init__(self, stack: ExitStack, number: int) -> None:
        """Build the missing images.

        stack: removes all containers when it is closed. number: distinguishes the projects' names from those of other
        instances. Raises ConfigurationError if Docker cannot be used, EngineError if an image cannot be built.
        """
        self._stack = stack
        self._number = number
        self._cables: dict[str, Engine] = {}
        self._trials = 0
        sys.stderr.write("building the images, minutes the first time\n")
        Engine(PROJECT).compose("build", limit_s=_BUILD_LIMIT_S)

    def run(self, trial: Trial) -> dict[str, Any]:
        """Run a trial in real time and return its figures.

        Raises SideFailedError if a side fails, EngineError if a command of Docker does.

        If netem cannot emulate this link, the sides emulate it as on loopback, and standard error reports that.
        """
        engine = self._cables.get(trial.link) or self._lay_cable(trial)
        self._trials += 1
        summaries = {side: f"/results/{side}-{self._trials}.json" for side in _SIDES}
        options = {
            "ROBOT_OPTIONS": [*trial.robot_arguments(), f"--summary={summaries['robot']}"],
            "OPERATOR_OPTIONS": [*trial.operator_arguments(), f"--summary={summaries['operator']}"],
        }
        settings = {name: shlex.join(["--status=json", *words]) for name, words in options.items()}
        engine.compose(
            *("up", "--no-start", "--no-deps", "--force-recreate", *_SIDES),
            settings=self._settings(trial) | settings,
        )
        with StartedSide("robot", engine.attached(engine.container("robot"))) as robot:
            robot.wait_for("listening", START_S)
            emulated = self._in_router(engine, "while ! test -e /link/emulated; do sleep 0.1; done; cat /link/emulated")
            if emulated:
                sys.stderr.write(f"NO netem here for --link {trial.link!r}: the sides emulate it themselves\n")
            before = self._packets(engine)
            with StartedSide("operator", engine.attached(engine.container("operator"))) as operator:
                run_for(robot, operator, trial.duration_s)
        after = self._packets(engine)
        lost = {direction: now.lost_share_since(before.get(direction, now)) for direction, now in after.items()}
        robot_said, operator_said = (engine.read_json(engine.container(side), path) for side, path in summaries.items())
        return figures_of(merge_summaries(robot_said, operator_said, []), None if emulated else lost)

    def _lay_cable(self, trial: Trial) -> Engine:
        engine = Engine(f"{PROJECT}-{self._number}-{len(self._cables)}")
        self._stack.callback(engine.remove)
        engine.compose("up", "--detach", "router", settings=self._settings(trial))
        self._cables[trial.link] = engine
        return engine

    def _settings(self, trial: Trial) -> dict[str, str]:
        return {"LINK": trial.link, "LINK_MODEL": trial.link_model, "RESTART": "no"}

    def _packets(self, engine: Engine) -> Mapping[Direction, Counted]:
        """Read how many packets netem has passed and dropped in each direction."""
        return count_packets(json.loads(self._in_router(engine, "tc -statistics -json qdisc show")))

    def _in_router(self, engine: Engine, command: str) -> str:
        return engine.docker("exec", engine.container("router"), "sh", "-c", command)
