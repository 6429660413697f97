"""Trial of a finger that pulls with constant force over a link, for virtual time, two processes, or containers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

from common.emulation.clauses import LinkModel
from common.emulation.spec import Direction


@dataclass(frozen=True)
class Trial:
    """Trial at the wall: the simulated person rests, arms, and pulls R2 with a constant force until the end."""

    link: str
    """Link by its name or in netem's words, as for `--link`"""
    haptics: bool
    seed: int
    """Seed of the scene, of the camera's and encoders' errors, and of the emulated link"""
    force_n: float = 3.0
    duration_s: float = 8.0
    """Duration from when the link is up, including 1.3 s plus one or two round trips for rest and arming"""
    link_model: LinkModel = "stream"
    """How a link that the sides emulate treats losses: as datagrams or as a stream, as for `--link-model`"""

    def robot_arguments(self) -> list[str]:
        """Return the robot side's flags, without those for link and address."""
        return ["--scene=wall", f"--seed={self.seed}"]

    def operator_arguments(self) -> list[str]:
        """Return the operator side's flags, without those for link and address."""
        haptics = "--haptics" if self.haptics else "--no-haptics"
        return ["--device=simulated", haptics, f"--seed={self.seed}", f"--pull-n={self.force_n}"]

    def link_arguments(self) -> list[str]:
        """Return the flags with which a side emulates the link."""
        return [f"--link={self.link}", f"--link-model={self.link_model}"]


def figures_of(
    summary: Mapping[str, Any], loss_shares: Mapping[Direction, float | None] | None = None
) -> dict[str, Any]:
    """Return a trial's figures from both sides' merged summary; None for a figure without a value.

    Delays are those while armed, and stiffness is R2's (0 to 1). Contacts with supports do not count as the first
    contact. A loss is a share of all transmissions, repeated ones included. loss_shares: measured losses, instead of
    those that the link's emulation counted.
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
        # Only while armed: a new TCP connection is slow for some round trips, which says nothing about the link.
        delay_ms = summary["driving_delay_ms"][direction]
        figures |= {f"{direction}_{name}_ms": delay_ms[name] for name in ("mean", "sd", "p50", "p99")}
        figures[f"{direction}_samples"] = summary["messages"][received[direction]]
        lost = _lost_share(summary["link"][direction]["achieved"]) if loss_shares is None else loss_shares[direction]
        figures[f"{direction}_lost_percent"] = None if lost is None else 100.0 * lost
    return figures


def _lost_share(achieved: Mapping[str, Any]) -> float | None:
    """Return the share of all transmissions that was lost; a stream's losses are counted by its retransmissions."""
    again = achieved["retransmitted"]
    put_on = achieved["sent"] + achieved["duplicated"] + again
    gone = achieved["lost"] + achieved["outage"] + achieved["dropped"] + again
    return gone / put_on if put_on else None
