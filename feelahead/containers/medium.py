"""Trials in containers: the sides in networks of their own, and the router's link between them."""

import json
import os
import shlex
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

from common.emulation.spec import Direction
from feelahead.both_sides.processes import StartedSide
from feelahead.both_sides.real_time import START_S, run_for
from feelahead.both_sides.summary import merge_summaries
from feelahead.both_sides.trial import Trial, TrialFigures, figures_of
from feelahead.containers.engine import Engine
from feelahead.containers.netem import Counted

PROJECT: Final = "feelahead-latency"
"""How the projects' names begin, one for each link."""
_BUILD_LIMIT_S: Final = 1500.0
_SIDES: Final = ("robot", "operator")


@contextmanager
def open_medium() -> Iterator["ContainerMedium"]:
    """Build the images where they are not built; nothing is left of the containers at the end.

    ConfigurationError where there is no engine, EngineError where an image cannot be built.
    """
    medium = ContainerMedium(os.getpid())
    try:
        yield medium
    finally:
        medium.close()


class ContainerMedium:
    """Two networks and a router for each link, which stay; both sides anew for each trial."""

    name = "containers"

    def __init__(self, number: int) -> None:
        """`number`: for names that no other run of ours uses."""
        self._number = number
        self._cables: dict[str, Engine] = {}
        Engine(PROJECT).compose("build", limit_s=_BUILD_LIMIT_S)

    def run(self, trial: Trial) -> TrialFigures:
        """Do it in real time; SideFailedError where a side fails, EngineError where the engine does."""
        engine = self._cables.get(trial.link) or self._lay_cable(trial)
        options = {
            "ROBOT_OPTIONS": trial.robot_arguments(),
            "OPERATOR_OPTIONS": [word for word in trial.operator_arguments() if word != "--device=simulated"],
        }
        settings = {name: shlex.join(["--status=json", *words]) for name, words in options.items()}
        engine.compose(
            *("up", "--no-start", "--no-deps", "--force-recreate", *_SIDES),
            settings=self._settings(trial) | settings,
        )
        before = self._packets(engine)
        with StartedSide("robot", engine.attached(engine.container("robot"))) as robot:
            robot.wait_for("listening", START_S)
            with StartedSide("operator", engine.attached(engine.container("operator"))) as operator:
                run_for(robot, operator, trial.duration_s)
        robot_said, operator_said = (self._summary(engine, side) for side in _SIDES)
        after = self._packets(engine)
        lost = {direction: after[direction].lost_share_since(before[direction]) for direction in before}
        return figures_of(merge_summaries(robot_said, operator_said, []), lost or None)

    def close(self) -> None:
        """Remove all of it."""
        for engine in self._cables.values():
            engine.remove()

    def _lay_cable(self, trial: Trial) -> Engine:
        engine = Engine(f"{PROJECT}-{self._number}-{len(self._cables)}")
        self._cables[trial.link] = engine
        engine.compose("up", "--detach", "router", settings=self._settings(trial))
        return engine

    def _settings(self, trial: Trial) -> dict[str, str]:
        return {"LINK": trial.link, "LINK_MODEL": trial.link_model, "RESTART": "no"}

    def _packets(self, engine: Engine) -> Mapping[Direction, Counted]:
        """What netem has counted so far; empty where it is the sides that emulate."""
        ask = "touch /link/count; while test -e /link/count; do sleep 0.1; done"
        command = f"{ask}; test ! -e /link/packets.json || cat /link/packets.json"
        said = engine.docker("exec", engine.container("router"), "sh", "-c", command)
        counted: dict[Direction, Counted] = {name: Counted(**one) for name, one in json.loads(said or "{}").items()}
        return counted

    def _summary(self, engine: Engine, side: str) -> dict[str, Any]:
        packed = engine.docker("cp", f"{engine.container(side)}:/results/{side}.json", "-")
        # A tar of one file, whose text goes from the first brace to the last.
        summary: dict[str, Any] = json.loads(packed[packed.index("{") : packed.rindex("}") + 1])
        return summary
