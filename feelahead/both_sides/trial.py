"""A trial of a constant finger over a link: the same in virtual time, in two processes, and in containers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

from common.emulation.clauses import LinkModel
from common.emulation.spec import Direction


@dataclass(frozen=True)
class Trial:
    """At the wall: rest, arm, and pull R2 with a constant force until the time is over."""

    link: str
    """A name or netem's words, like `--link`"""
    haptics: bool
    seed: int
    """For the scene, the errors of camera and encoders, and the emulated link"""
    force_n: float = 3.0
    duration_s: float = 8.0
    """Counted from when the link is up; rest and arming take 1.3 s and a round trip or two of it"""
    link_model: LinkModel = "stream"
    """For a link that the process emulates"""

    def robot_arguments(self) -> list[str]:
        """The robot side's flags, without link and address."""
        return ["--scene=wall", f"--seed={self.seed}"]

    def operator_arguments(self) -> list[str]:
        """The operator side's flags, without link and address."""
        haptics = "--haptics" if self.haptics else "--no-haptics"
        return ["--device=simulated", haptics, f"--seed={self.seed}", f"--person.pull-n={self.force_n}"]

    def link_arguments(self) -> list[str]:
        """The flags of either side that make it emulate the link."""
        return [f"--link={self.link}", f"--link-model={self.link_model}"]


def figures_of(
    summary: Mapping[str, Any], loss_shares: Mapping[Direction, float | None] | None = None
) -> dict[str, Any]:
    """Take a trial's figures from both sides' merged summary; None where there is none.

    Delays while the arm was armed, stiffness of R2 (0 to 1), first contact supports aside. What was lost is a share of
    all that was put on the link, first sendings and repeated ones; `loss_shares` replaces the emulated link's.
    """
    contact = summary["first_contact"] or {"with": None, "speed_mm_s": None}
    figures = {
        "first_contact": contact["with"],
        "contact_speed_mm_s": contact["speed_mm_s"],
        "min_distance_mm": summary["min_distance_mm"],
        "stiffness_max": summary["stiffness"]["r2"]["max"] or 0.0,
        "tick_p99_us": summary["tick_us"]["p99"],
        "stops": len(summary["stops"]),
    }
    received: Mapping[Direction, str] = {"to_robot": "motion_received", "to_operator": "stiffness_received"}
    for direction in get_args(Direction):
        # A new connection of TCP takes some round trips to carry all that is sent, which is no figure of the link.
        delay_ms = summary["driving_delay_ms"][direction]
        figures |= {f"{direction}_{name}_ms": delay_ms[name] for name in ("mean", "sd", "p50", "p99")}
        figures[f"{direction}_samples"] = summary["messages"][received[direction]]
        lost = _lost_share(summary["link"][direction]["achieved"]) if loss_shares is None else loss_shares[direction]
        figures[f"{direction}_lost_percent"] = None if lost is None else 100.0 * lost
    return figures


def _lost_share(achieved: Mapping[str, Any]) -> float | None:
    """A stream's losses show as sendings on top of the first."""
    again = achieved["retransmitted"]
    put_on = achieved["sent"] + achieved["duplicated"] + again
    gone = achieved["lost"] + achieved["outage"] + achieved["dropped"] + again
    return gone / put_on if put_on else None
