"""Trial of a constant finger over a link: the same in virtual time, in two processes, and in containers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

from common.emulation.clauses import LinkModel
from common.emulation.spec import Direction


@dataclass(frozen=True)
class Trial:
    """Trial at the wall: rest, arm, and pull R2 with a constant force until the time is over."""

    link: str
    """Name or netem's words, like `--link`"""
    haptics: bool
    seed: int
    """Seed of the scene, the errors of camera and encoders, and the emulated link"""
    force_n: float = 3.0
    duration_s: float = 8.0
    """Duration with the link up; rest and arming take 1.3 s and one or two round trips of it"""
    link_model: LinkModel = "stream"
    """Model of a link that the process emulates"""

    def robot_arguments(self) -> list[str]:
        """Return the robot side's flags, without link and address."""
        return ["--scene=wall", f"--seed={self.seed}"]

    def operator_arguments(self) -> list[str]:
        """Return the operator side's flags, without link and address."""
        haptics = "--haptics" if self.haptics else "--no-haptics"
        return ["--device=simulated", haptics, f"--seed={self.seed}", f"--person.pull-n={self.force_n}"]

    def link_arguments(self) -> list[str]:
        """Return the flags by which either side emulates the link."""
        return [f"--link={self.link}", f"--link-model={self.link_model}"]


def figures_of(
    summary: Mapping[str, Any], loss_shares: Mapping[Direction, float | None] | None = None
) -> dict[str, Any]:
    """Return a trial's figures from both sides' merged summary; None for missing ones.

    Delays are those while armed, stiffness is R2's (0 to 1), and the first contact leaves supports aside. Losses are a
    share of all transmissions, with repeated ones; `loss_shares` replaces the emulated link's.
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
        # A new TCP connection is slow for some round trips, which is no figure of the link.
        delay_ms = summary["driving_delay_ms"][direction]
        figures |= {f"{direction}_{name}_ms": delay_ms[name] for name in ("mean", "sd", "p50", "p99")}
        figures[f"{direction}_samples"] = summary["messages"][received[direction]]
        lost = _lost_share(summary["link"][direction]["achieved"]) if loss_shares is None else loss_shares[direction]
        figures[f"{direction}_lost_percent"] = None if lost is None else 100.0 * lost
    return figures


def _lost_share(achieved: Mapping[str, Any]) -> float | None:
    """Return the lost share of all transmissions; in a stream losses appear as retransmissions."""
    again = achieved["retransmitted"]
    put_on = achieved["sent"] + achieved["duplicated"] + again
    gone = achieved["lost"] + achieved["outage"] + achieved["dropped"] + again
    return gone / put_on if put_on else None
