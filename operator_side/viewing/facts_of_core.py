"""Compute the facts of the operator side from its core, only while they are shown or recorded."""

import math
from collections.abc import Iterable
from typing import Final, cast

import msgspec

from common.status.codes import InputSource
from common.status.statuses import OperatorStatus
from operator_side.controller.feel import FREE_TRIGGER
from operator_side.core import OperatorSide
from operator_side.viewing.facts import (
    DelayFacts,
    HandsFacts,
    OperatorFacts,
    PictureFacts,
    SceneFacts,
    Ten,
    TriggerFacts,
)

_RECENT_S: Final = 1.0
_TAIL: Final = 0.99


class Surroundings(msgspec.Struct, frozen=True):
    """Facts that the core does not have and the process adds."""

    hands: InputSource
    asked_to_robot: str = ""
    """Delay profile that this side emulates towards the robot, in netem's words"""
    page: HandsFacts | None = None
    pictures: PictureFacts | None = None


def operator_facts(
    core: OperatorSide, status: OperatorStatus, around: Surroundings, now_s: float, scene: SceneFacts | None = None
) -> OperatorFacts:
    """Compute the facts at `now_s`.

    status: `core.status(now_s)`, completed with the fields that only the process knows.
    """
    update, written, lease = core.stiffness, core.haptics.written, core.lease
    pulled, meets = [status.l2_pulled, status.r2_pulled], [status.l2_meets, status.r2_meets]
    order = -1 if core.settings.swap_sides else 1
    needed: list[float | None] = [None, None]
    fields = [None, None] if update is None else [update.l2, update.r2][::order]
    if update is not None:
        back, forth = (travel or 0.0 for travel in pulled[::order])
        needed = list(core.haptics.needed_m(update, (back, forth), now_s)[::order])
    raw = (0.0, 0.0) if core.intent is None else core.intent.raw
    triggers = []
    for k, (strengths, rendered) in enumerate(
        ((written.l2, core.haptics.rendering.l2), (written.r2, core.haptics.rendering.r2))
    ):
        zones, field, travel = cast(Ten, strengths or FREE_TRIGGER), fields[k], pulled[k]
        triggers.append(
            TriggerFacts(
                travel=travel,
                raw=None if travel is None else raw[k],
                zones=zones,
                meets=meets[k] or 0,
                free=rendered.free_travel,
                course_stiffness=None if field is None else field.course_stiffness,
                needed_m=needed[k],
                fast_m=() if field is None else field.fast_m,
                slow_m=() if field is None else field.slow_m,
            )
        )
    recent = [arrival for arrival in core.link.recent if now_s - arrival[0] <= _RECENT_S]
    offset = core.link.clock_offset
    return OperatorFacts(
        now_s=now_s,
        offset_s=offset.offset_s,
        status=status,
        screen=core.screen,
        l2=triggers[0],
        r2=triggers[1],
        rumble=0.0 if written.rumble is None else max(written.rumble.left, written.rumble.right),
        advancing="R2" if order == 1 else "L2",
        to_operator=_delay("", (there for _, there, _ in recent)),
        to_robot=_delay(around.asked_to_robot, (_back(there, both) for _, there, both in recent)),
        round_trip_ms=None if offset.round_trip_s is None else 1e3 * offset.round_trip_s,
        field_age_ms=1e3 * (now_s - core.newest_stiffness.received_s) if core.newest_stiffness.count else None,
        hands=around.hands,
        may_tune=lease is not None and lease.may_tune,
        probability=None if lease is None else lease.probability,
        page=around.page,
        pictures=around.pictures,
        scene=scene,
    )


def _back(there_s: float | None, both_s: float | None) -> float | None:
    """Estimate the delay to the robot: the round trip less the delay from the robot.

    If the delay from the robot is unknown, half the round trip.
    """
    if both_s is None:
        return None
    return both_s / 2.0 if there_s is None else max(0.0, both_s - there_s)


def _delay(asked: str, samples_s: Iterable[float | None]) -> DelayFacts:
    known_ms = [1e3 * sample for sample in samples_s if sample is not None]
    if not known_ms:
        return DelayFacts(asked, None, None, None)
    nearest_rank = math.ceil(_TAIL * len(known_ms)) - 1
    return DelayFacts(asked, sum(known_ms) / len(known_ms), sorted(known_ms)[nearest_rank], known_ms[-1])
