"""A trial of a constant finger over a link: the same in virtual time, in two processes, and wherever else they run."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from common.emulation.clauses import LinkModel
from common.emulation.spec import Direction
from operator_side.settings import OperatorSettings
from operator_side.simulated_person.settings import PersonSettings
from robot_side.settings import RobotSettings
from robot_side.simulation.built_in_scenes import SceneName


@dataclass(frozen=True)
class Trial:
    """What is done: rest, arm, and pull R2 with a constant force until the time is over."""

    link: str
    """As `--link` takes it: a name, or netem's words"""
    haptics: bool
    seed: int
    """Of the scene, the errors of camera and encoders, and the emulated link"""
    force_n: float = 3.0
    duration_s: float = 8.0
    """From the moment at which the link is up; rest and arming take 1.3 s and a round trip or two of it"""
    link_model: LinkModel = "stream"
    """Where the link is emulated in the process"""
    scene: SceneName = "wall"

    def robot_settings(self) -> RobotSettings:
        """The robot side's, with the link emulated in its process."""
        return RobotSettings(scene=self.scene, seed=self.seed, link=self.link, link_model=self.link_model)

    def operator_settings(self) -> OperatorSettings:
        """The operator side's, with the link emulated in its process."""
        return OperatorSettings(
            device="simulated",
            haptics=self.haptics,
            seed=self.seed,
            link=self.link,
            link_model=self.link_model,
            person=PersonSettings(pull_n=self.force_n),
        )

    def robot_arguments(self) -> list[str]:
        """The robot side's flags, without link and address."""
        return [f"--scene={self.scene}", f"--seed={self.seed}"]

    def operator_arguments(self) -> list[str]:
        """The operator side's flags, without link and address."""
        haptics = "--haptics" if self.haptics else "--no-haptics"
        return ["--device=simulated", haptics, f"--seed={self.seed}", f"--person.pull-n={self.force_n}"]

    def link_arguments(self) -> list[str]:
        """The flags of either side that make it emulate the link."""
        return [f"--link={self.link}", f"--link-model={self.link_model}"]


@dataclass(frozen=True)
class WayFigures:
    """What came of the messages in one direction; delays while the arm was armed."""

    mean_ms: float | None
    sd_ms: float | None
    p50_ms: float | None
    p99_ms: float | None
    samples: int
    """Messages that arrived, in the whole run"""
    loss_share: float | None
    """Of everything that was put on the link, first sendings and repeated ones alike; None where nobody counted"""


@dataclass(frozen=True)
class TrialFigures:
    """What came of one trial."""

    to_robot: WayFigures
    to_operator: WayFigures
    first_contact: str | None
    """What the gripper touched first, supports aside; None for nothing"""
    contact_speed_mm_s: float | None
    min_distance_mm: float | None
    stiffness_max: float
    """Of R2, 0 to 1"""
    tick_p99_us: float | None
    stops: int
    """How often the robot side stopped the arm"""


class Medium(Protocol):
    """Where both sides run, and what carries their messages."""

    @property
    def name(self) -> str:
        """For tables."""
        ...

    def run(self, trial: Trial) -> TrialFigures:
        """Do it; FeelaheadError where it could not be done."""
        ...


def figures_of(summary: Mapping[str, Any], loss_shares: Mapping[Direction, float | None] | None = None) -> TrialFigures:
    """The figures in both sides' merged summary; `loss_shares` in place of what the emulated link lost."""
    received: Mapping[Direction, str] = {"to_robot": "motion_received", "to_operator": "stiffness_received"}

    def way(direction: Direction) -> WayFigures:
        # A new connection of TCP takes some round trips to carry all that is sent, which is no figure of the link.
        delay_ms = summary["driving_delay_ms"][direction]
        lost = _lost_share(summary["link"][direction]["achieved"]) if loss_shares is None else loss_shares[direction]
        samples = int(summary["messages"][received[direction]])
        return WayFigures(delay_ms["mean"], delay_ms["sd"], delay_ms["p50"], delay_ms["p99"], samples, lost)

    contact = summary["first_contact"]
    return TrialFigures(
        to_robot=way("to_robot"),
        to_operator=way("to_operator"),
        first_contact=None if contact is None else contact["with"],
        contact_speed_mm_s=None if contact is None else contact["speed_mm_s"],
        min_distance_mm=summary["min_distance_mm"],
        stiffness_max=summary["stiffness"]["r2"]["max"] or 0.0,
        tick_p99_us=summary["tick_us"]["p99"],
        stops=len(summary["stops"]),
    )


def _lost_share(achieved: Mapping[str, Any]) -> float | None:
    """A stream's losses show as sendings on top of the first."""
    again = achieved["retransmitted"]
    put_on = achieved["sent"] + achieved["duplicated"] + again
    gone = achieved["lost"] + achieved["outage"] + achieved["dropped"] + again
    return gone / put_on if put_on else None
