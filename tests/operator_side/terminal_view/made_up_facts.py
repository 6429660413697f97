"""Facts of a run that nobody drove, for whatever draws them."""

import math

import msgspec

from common.command.live_view import Value
from operator_side.facts import DelayFacts, OperatorFacts, TriggerFacts

STATUS: dict[str, Value] = {
    "link": "up",
    "state": "armed",
    "stopped_because": None,
    "owner": "armed",
    "controller": "simulated DualSense",
    "person": "approaching",
    "feel": "stiff",
    "haptics": True,
    "release_first": False,
    "L2_pulled": 0.0,
    "R2_pulled": 0.4,
    "nearest": "bottle",
    "nearest_mm": 34.0,
    "target": "mug",
    "target_mm": 120.0,
    "holding": "nothing",
    "delay_ms": 52.0,
    "enlargement_mm": 23.0,
    "loop_age_ms": 104.0,
    "overlap_mm3": 0.0,
    "tick_p99_us": 140.0,
}
RELEASED = TriggerFacts(0.0, 0.0, (0,) * 10, 0, 1.0, 0.0, 0.002, (0.4,) * 8, (0.4,) * 8)
PULLED = TriggerFacts(
    travel=0.4,
    raw=0.38,
    zones=(0, 0, 0, 1, 2, 4, 6, 8, 8, 8),
    meets=2,
    free=0.35,
    stiffness=0.31,
    needed_m=0.052,
    fast_m=(0.031, 0.036, 0.041, 0.047, 0.052, 0.058, 0.063, 0.069),
    slow_m=(0.044, 0.049, 0.054, 0.060, 0.065, 0.071, 0.076, 0.082),
)


def facts_of(now_s: float = 100.0, r2: TriggerFacts = PULLED, **status: Value) -> OperatorFacts:
    """An armed approach at `now_s`, with what `status` says otherwise."""
    return OperatorFacts(
        now_s=now_s,
        offset_s=0.0,
        status={**STATUS, **status},
        l2=RELEASED,
        r2=r2,
        rumble=0.0,
        advancing="R2",
        to_operator=DelayFacts("", 52.1, 61.0, 50.4),
        to_robot=DelayFacts("delay 50ms 10ms distribution normal", 51.7, 60.2, 51.0),
        round_trip_ms=103.8,
        field_age_ms=0.9,
        hands="person",
        may_tune=True,
        probability=0.99,
    )


def facts_in_motion(now_s: float) -> OperatorFacts:
    """The same with something to see: the finger goes to and fro, and the delay wanders."""
    phase = 0.5 - 0.5 * math.cos(now_s)
    pulled = msgspec.structs.replace(
        PULLED, travel=0.9 * phase, raw=0.9 * phase, meets=round(8 * phase**2), stiffness=phase**2
    )
    made = facts_of(
        now_s, pulled, R2_pulled=0.9 * phase, overlap_mm3=4000.0 * phase**3, tick_p99_us=100.0 + 80.0 * phase
    )
    delay = DelayFacts("", 52.0, 61.0, 50.0 + 8.0 * math.sin(3.0 * now_s))
    return msgspec.structs.replace(made, to_operator=delay)
