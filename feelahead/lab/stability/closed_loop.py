"""Closed loop of finger, trigger, link and arm before a wall: whether it comes to rest, chatters or touches."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from common.arrays import FloatArray
from feelahead.lab.approaches.approach import Approach, PullRun
from feelahead.lab.approaches.frozen import frozen_scene
from feelahead.lab.approaches.outcome import Trace, reversals, stands
from feelahead.lab.table import Row, Table
from feelahead.printing.pictures import figure
from operator_side.controller.feel import MAX_STRENGTH
from operator_side.dualsense.simulated.controller import SimulatedDualSense

State = Literal["rests", "chatters", "touches", "moves on"]
PULL_N: Final = 2.0
_LAST_S: Final = 2.0
_SWING: Final = 0.02
"""Least change of travel that counts as a reversal: a fifth of a zone"""
_FEWEST: Final = 4
"""Reversals in the last 2 s from which on travel or speed chatter: two whole cycles"""
_MARKS: Final[dict[State, str]] = {"rests": "o", "chatters": "~", "touches": "x", "moves on": ">"}


@dataclass(frozen=True)
class Loop:
    """Cell: a pull of constant force towards the wall."""

    delay_ms: float
    """Delay each way"""
    effect_of_pull: float
    """Force of the strongest effect, as a share of the pull's"""
    finger_ms: float
    """Time constant with which the finger follows the balance of forces"""
    duration_s: float = 6.0


def run_loop(cell: Loop, seed: int) -> Row:
    """Pull R2 with 2 N; FeelaheadError if the robot is not armed."""
    strongest_n = cell.effect_of_pull * PULL_N
    link = f"delay {cell.delay_ms:g}ms" if cell.delay_ms else ""
    approach = Approach(frozen_scene("wall"), PULL_N, strongest_n=strongest_n, link=link, seed=seed)
    device = SimulatedDualSense(strength_step_n=strongest_n / MAX_STRENGTH, finger_s=1e-3 * cell.finger_ms)
    run = PullRun(approach, device=device)
    began_s = run.arm()
    for _ in run.go_on(began_s + cell.duration_s):
        pass
    return judged(run.trace(), touches=run.onset is not None) | {"why": run.disarmed_because}


def judged(trace: Trace, *, touches: bool) -> Row:
    """Return the state at the end, and travel and speed over the last 2 s."""
    last = trace.time_s > trace.time_s[-1] - _LAST_S
    travel, speed_mm_s = trace.travel[last], 1e3 * trace.speed_m_s[last]
    turns = max(reversals(travel.tolist(), _SWING), reversals((1e-3 * speed_mm_s).tolist()))
    state: State = "moves on"
    if touches:
        state = "touches"
    elif turns >= _FEWEST:
        state = "chatters"
    elif stands(trace):
        state = "rests"
    return {
        "state": state,
        "reversals": turns,
        "travel_swing": float(np.ptp(travel)),
        "speed_swing_mm_s": float(np.ptp(speed_mm_s)),
        "gap_mm": 1e3 * float(trace.gap_m[-1]),
        "ended_s": float(trace.time_s[-1]),
    }


def draw_map(loops: Table, path: Path) -> None:
    """Draw a panel for each finger: travel's swing in the last 2 s over delay and strength, with the state's mark."""
    fingers = [key for (key,), _ in loops.groups("finger_ms")]
    with figure(path, 1, len(fingers), figsize=(3.2 * len(fingers) + 0.8, 3.2), squeeze=False, sharey=True) as (
        drawn,
        axes,
    ):
        for ax, finger_ms in zip(axes[0], fingers, strict=True):
            image = _draw_panel(ax, loops.where(finger_ms=finger_ms))
            ax.set_title(f"finger {finger_ms:g} ms", fontsize=8)
        axes[0][0].set_ylabel("strongest effect, of the pull")
        drawn.colorbar(image, ax=axes[0].tolist(), label="swing of R2's travel in the last 2 s")
        words = "   ".join(f"{mark} {state}" for state, mark in _MARKS.items())
        drawn.suptitle(f"a pull of {PULL_N:g} N towards a wall\n{words}", fontsize=8)


def _draw_panel(ax: Any, loops: Table) -> Any:
    delays, shares = (sorted(set(loops.values(name))) for name in ("delay_ms", "effect_of_pull"))
    swings: FloatArray = np.full((len(shares), len(delays)), np.nan)
    for row in loops:
        x, y = delays.index(row["delay_ms"]), shares.index(row["effect_of_pull"])
        swings[y, x] = row["travel_swing"]
        ax.text(x, y, _MARKS[row["state"]], ha="center", va="center", color="white", fontweight="bold")
    image = ax.imshow(swings, origin="lower", aspect="auto", vmin=0.0, vmax=0.5, cmap="viridis")
    ax.set_xticks(range(len(delays)), [f"{delay:g}" for delay in delays])
    ax.set_yticks(range(len(shares)), [f"{share:g}" for share in shares])
    ax.set_xlabel("delay each way, ms")
    return image
