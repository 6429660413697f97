"""LeRobot's teleoperator `feelahead`: LeRobot's own loop becomes the driver of feelahead's arm.

    lerobot-teleoperate --robot.type=so101_follower ... --teleop.type=feelahead --teleop.address=tcp://127.0.0.1:5601

Each observation leaves as a state for `feelahead-robot --arm`; `get_action` returns the goals to which commands lead.
A teleoperator of LeRobot 0.6 sees no observation. So the loops of its two commands are wrapped: while one runs, the
robot's `get_observation` passes on what it returns. Nothing else is changed, and nothing without this teleoperator.
"""

import importlib.metadata
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any, Final, NoReturn

from lerobot.teleoperators.config import TeleoperatorConfig
from lerobot.teleoperators.teleoperator import Teleoperator

from lerobot_teleoperator_feelahead.lerobot_arm import SCALES, Driver

RELEASE: Final = "0.6"
"""Release of LeRobot whose loops are known"""
LOOPS: Final = {"lerobot_teleoperate": "teleop_loop", "lerobot_record": "record_loop"}
"""Function with the loop of each command of LeRobot, by module"""


@TeleoperatorConfig.register_subclass("feelahead")
@dataclass(kw_only=True)
class FeelaheadTeleopConfig(TeleoperatorConfig):
    """Settings, as flags `--teleop.NAME`."""

    address: str = "tcp://127.0.0.1:5601"
    """Address of `feelahead-robot --arm`"""


class FeelaheadTeleop(Teleoperator):
    """Teleoperator whose goals come from feelahead's robot side; the triggers are at feelahead's operator side."""

    config_class = FeelaheadTeleopConfig
    name = "feelahead"

    def __init__(self, config: FeelaheadTeleopConfig) -> None:
        """SystemExit with one line for another release of LeRobot, and for a program without one of its loops."""
        if not (found := importlib.metadata.version("lerobot")).startswith(f"{RELEASE}."):
            _end(f"lerobot = {found}; valid: {RELEASE}.x, whose loops this teleoperator knows")
        if not (wrapped := _wrap_loops()):
            _end("program = another one; valid: lerobot-teleoperate or lerobot-record")
        sys.stderr.write(f"feelahead: observes the robot in {', '.join(wrapped)}; a failure of its bus ends the loop\n")
        super().__init__(config)
        self.config = config
        self._driver: Driver | None = None
        self._goals: dict[str, float] | None = None

    @property
    def action_features(self) -> dict[str, type]:
        """Goals: degrees of the joints, and hundredths of the gripper's way."""
        return {f"{name}.pos": float for name in SCALES}

    @property
    def feedback_features(self) -> dict[str, type]:
        """Return none: what is ahead is felt at the operator side."""
        return {}

    @property
    def is_connected(self) -> bool:
        """Whether `connect` was called"""
        return self._driver is not None

    @property
    def is_calibrated(self) -> bool:
        """True: there is nothing to calibrate"""
        return True

    def calibrate(self) -> None:
        """Do nothing."""

    def configure(self) -> None:
        """Do nothing."""

    def connect(self, calibrate: bool = True) -> None:
        """Connect to the robot side, at once or whenever it starts."""
        del calibrate
        self._driver = Driver(self.config.address)

    def disconnect(self) -> None:
        """Fall silent: the robot side loses the arm after 0.1 s."""
        self._driver = None

    def observe(self, observe: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """Return an observation that `observe` makes, after its state was sent; a failure is sent, and raised again."""
        if self._driver is None:
            raise ConnectionError("feelahead is not connected")
        began_s = time.monotonic()
        try:
            seen = observe()
        except Exception as error:
            if self._goals is not None:
                self._driver.send(f"robot: {str(error).strip().partition(chr(10))[0]}")
            raise
        self._goals = self._driver.turn(seen, began_s)
        return seen

    def get_action(self) -> dict[str, float]:
        """Return the newest goals; RuntimeError before the first observation."""
        if self._goals is None:
            raise RuntimeError("feelahead has no observation of the robot yet")
        return dict(self._goals)

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Do nothing."""


def _end(why: str) -> NoReturn:
    sys.stderr.write(f"feelahead: {why}\n")
    raise SystemExit(2)


def _wrap_loops() -> list[str]:
    """Wrap the loops of LeRobot's running command, whether it was started as a module or by its name; return these."""
    wrapped = []
    for module_name, loop_name in LOOPS.items():
        for module in (sys.modules.get(f"lerobot.scripts.{module_name}"), sys.modules.get("__main__")):
            loop = getattr(module, loop_name, None)
            if loop is not None:
                if not hasattr(loop, "observes_for_feelahead"):
                    setattr(module, loop_name, _observing(loop))
                wrapped.append(loop_name)
    return wrapped


def _observing(loop: Callable[..., Any]) -> Callable[..., Any]:
    """Return the loop, during which a robot's observations reach the teleoperator."""

    @wraps(loop)
    def observing(*arguments: Any, **named: Any) -> Any:
        robot, teleop = named.get("robot"), named.get("teleop")
        if robot is None or not isinstance(teleop, FeelaheadTeleop):
            return loop(*arguments, **named)
        observe = robot.get_observation
        robot.get_observation = lambda: teleop.observe(observe)
        try:
            return loop(*arguments, **named)
        finally:
            del robot.get_observation

    observing.observes_for_feelahead = True  # type: ignore[attr-defined]
    return observing
