"""A link profile in the words that the grammar reads."""

import shlex

from common.emulation.distribution import DelayTable, Distribution
from common.emulation.profile import QUEUE_LIMIT, Chance, LinkProfile
from common.emulation.slots import Slot
from common.units import format_duration, format_rate, format_share


def format_profile(profile: LinkProfile) -> str:
    """The profile in the words that `parse_profile` reads."""
    clauses = [_format_delay(profile)]
    if profile.loss is not None:
        clauses.append(profile.loss.words())
    clauses += [f"{name} {_format_chance(getattr(profile, name))}" for name in ("duplicate", "corrupt", "reorder")]
    clauses = [clause for clause in clauses if not clause.endswith(" ")]
    if profile.reorder is not None and profile.gap > 1:
        clauses.append(f"gap {profile.gap}")
    if profile.rate is not None:
        rate = profile.rate
        numbers = [rate.overhead_bytes, rate.cell_bytes, rate.cell_overhead_bytes]
        while numbers and numbers[-1] == 0:
            numbers.pop()
        clauses.append(" ".join(["rate", format_rate(rate.bits_per_second), *map(str, numbers)]))
    if profile.limit != QUEUE_LIMIT:
        clauses.append(f"limit {profile.limit}")
    if profile.slot is not None:
        clauses.append(_format_slot(profile.slot))
    if profile.trace is not None:
        clauses.append(f"trace {shlex.quote(profile.trace.name)}")
    for outage in profile.outages:
        every = "" if outage.every_s is None else f" every {format_duration(outage.every_s)}"
        clauses.append(f"outage {format_duration(outage.duration_s)} at {format_duration(outage.at_s)}{every}")
    if profile.retransmit_s is not None:
        clauses.append(f"retransmit {format_duration(profile.retransmit_s)}")
    return " ".join(filter(None, clauses))


def _format_delay(profile: LinkProfile) -> str:
    if profile.delay_s == 0.0 and profile.jitter_s == 0.0:
        return ""
    words = ["delay", format_duration(profile.delay_s)]
    shape = profile.distribution
    if profile.jitter_s or profile.delay_correlation or shape != "uniform":
        words.append(format_duration(profile.jitter_s))
        if profile.delay_correlation:
            words.append(format_share(profile.delay_correlation))
        if shape != "uniform":
            words += ["distribution", _format_shape(shape)]
    return " ".join(words)


def _format_shape(shape: Distribution | DelayTable) -> str:
    return shlex.quote(shape.name) if isinstance(shape, DelayTable) else shape


def _format_slot(slot: Slot) -> str:
    if slot.shape is None:
        words = ["slot", format_duration(slot.least_s), format_duration(slot.most_s)]
    else:
        times = (format_duration(slot.shape.mean_s), format_duration(slot.shape.jitter_s))
        words = ["slot distribution", _format_shape(slot.shape.distribution), *times]
    for name, budget in (("packets", slot.packets), ("bytes", slot.size_bytes)):
        if budget is not None:
            words += [name, str(budget)]
    return " ".join(words)


def _format_chance(chance: Chance | None) -> str:
    if chance is None:
        return ""
    correlation = f" {format_share(chance.correlation)}" if chance.correlation else ""
    return format_share(chance.share) + correlation
