"""Grammar of a link profile: that of netem, with further clauses for traces, outages and retransmission."""

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast, get_args

from common.emulation.clauses import Chance, LinkModel, Outage, Rate
from common.emulation.distribution import Distribution
from common.emulation.loss import GilbertElliott, RandomLoss
from common.emulation.trace import Trace
from common.errors import ConfigurationError
from common.units import parse_duration, parse_rate, parse_share

GRAMMAR = {
    "delay": "delay TIME [JITTER [CORRELATION%]] [distribution uniform|normal|pareto|paretonormal|exponential]",
    "loss": "loss [random] P% [CORRELATION%] | loss gemodel P% [R% [1-H% [1-K%]]]",
    "duplicate": "duplicate P% [CORRELATION%]",
    "corrupt": "corrupt P% [CORRELATION%]",
    "reorder": "reorder P% [CORRELATION%] [gap N]",
    "rate": "rate RATE [PACKETOVERHEAD]",
    "limit": "limit MESSAGES",
    "trace": "trace FILE.csv",
    "outage": "outage DURATION at TIME [every TIME]",
    "retransmit": "retransmit TIME",
}
"""Form of each clause of a profile. Clauses may be in any order; each may occur at most once, except `outage`."""

_Value = TypeVar("_Value")


class _Words:
    """Reader of the words of a profile, one after the other."""

    def __init__(self, profile: str, spec: str) -> None:
        self.spec = spec
        self.clause = ""
        """Clause that is being read"""
        try:
            self._words = shlex.split(profile)[::-1]
        except ValueError as error:
            raise ConfigurationError(f"link {spec!r}: {str(error).lower()}; valid: quotes in pairs") from error

    def begin(self) -> bool:
        """Take the next word as a clause; return False at the end. Raises ConfigurationError for an unknown clause."""
        if not self._words:
            return False
        self.clause = self._words.pop()
        if self.clause not in GRAMMAR:
            valid = f"clauses such as {GRAMMAR['delay']}, and {', '.join([*GRAMMAR][1:])}"
            raise ConfigurationError(f"link {self.spec!r}: the clause {self.clause!r} is unknown; valid: {valid}")
        return True

    def accept(self, word: str) -> bool:
        return self._words[-1:] == [word] and bool(self._words.pop())

    def number_follows(self, *, percent: bool) -> bool:
        word = self._words[-1] if self._words else ""
        return word[:1] in tuple("0123456789+-.") and word.endswith("%") is percent

    def value(self, read: Callable[[str, str], _Value], name: str) -> _Value:
        """Return the next word, parsed by `read`; raises ConfigurationError if there is none."""
        if not self._words:
            raise self.error(f"{self.clause!r} is given without {name}")
        return read(self._words.pop(), f"link {self.spec!r}: {name}")

    def shares(self, *names: str) -> list[float]:
        """Return the percentages that follow as shares: at least one, at most one for each of `names`."""
        shares = [self.value(parse_share, names[0])]
        while len(shares) < len(names) and self.number_follows(percent=True):
            shares.append(self.value(parse_share, names[len(shares)]))
        return shares

    def error(self, what: str, clause: str | None = None) -> ConfigurationError:
        return ConfigurationError(f"link {self.spec!r}: {what}; valid: {GRAMMAR[clause or self.clause]}")


def read_fields(profile: str, spec: str, model: LinkModel) -> dict[str, Any]:
    """Parse the words of `profile` into fields of `LinkProfile`. `spec`: the specification that contains `profile`.

    Raises ConfigurationError, in one line that quotes `spec`, for an invalid profile.
    """
    words = _Words(profile, spec)
    settings: dict[str, Any] = {}
    seen: set[str] = set()
    while words.begin():
        if words.clause in seen and words.clause != "outage":
            raise words.error(f"the clause {words.clause!r} is given twice")
        seen.add(words.clause)
        try:
            found = _READERS[words.clause](words)
        except ConfigurationError:
            raise
        except ValueError as error:
            raise ConfigurationError(f"link {spec!r}: {words.clause}: {error}") from error
        outages = settings.get("outages", ()) + found.get("outages", ())
        settings |= {**found, "outages": outages}
    if "trace" in seen and (other := seen & {"delay", "loss", "reorder"}):
        raise words.error(f"'trace' has its own delays and losses, and excludes {min(other)!r}", "trace")
    if "reorder" in seen and settings.get("delay_s", 0.0) == 0.0:
        raise words.error("'reorder' is given without a delay, so no message can overtake another", "delay")
    if "retransmit" in seen and model != "stream":
        raise words.error("'retransmit' is for streams: the datagram model never sends a message again", "retransmit")
    return settings


def _delay(words: _Words) -> dict[str, Any]:
    found: dict[str, Any] = {"delay_s": words.value(parse_duration, "delay")}
    if words.number_follows(percent=False):
        found["jitter_s"] = words.value(parse_duration, "jitter")
        if words.number_follows(percent=True):
            # Without effect, as in netem: its delays stay independent (measured lag-1 correlation 0).
            words.value(parse_share, "correlation")
    if words.accept("distribution"):
        if "jitter_s" not in found:
            raise words.error("'distribution' is given without a jitter, whose distribution it is")
        found["distribution"] = words.value(_shape, "distribution")
    return found


def _loss(words: _Words) -> dict[str, Any]:
    if words.accept("gemodel"):
        p, *rest = words.shares("p", "r", "1-h", "1-k")
        # One probability alone is independent loss: with r = 1 − p the next state does not depend on the last.
        return {"loss": GilbertElliott(p, *(rest or [1.0 - p]))}
    if words.accept("state"):
        raise words.error("'loss state' is not emulated")
    words.accept("random")
    return {"loss": RandomLoss(*words.shares("probability", "correlation"))}


def _chance(words: _Words) -> dict[str, Any]:
    found: dict[str, Any] = {words.clause: Chance(*words.shares("probability", "correlation"))}
    if words.clause == "reorder" and words.accept("gap"):
        found["gap"] = words.value(_positive, "gap")
    return found


def _rate(words: _Words) -> dict[str, Any]:
    bits_per_second = words.value(parse_rate, "rate")
    overhead = words.value(_small_integer, "packet overhead") if words.number_follows(percent=False) else 0
    return {"rate": Rate(bits_per_second, overhead)}


def _outage(words: _Words) -> dict[str, Any]:
    duration_s = words.value(parse_duration, "duration")
    if not words.accept("at"):
        raise words.error("'outage' is given without 'at' and a time")
    at_s = words.value(parse_duration, "begin")
    every_s = words.value(parse_duration, "period") if words.accept("every") else None
    return {"outages": (Outage(duration_s, at_s, every_s),)}


_READERS: dict[str, Callable[[_Words], dict[str, Any]]] = {
    "delay": _delay,
    "loss": _loss,
    **dict.fromkeys(("duplicate", "corrupt", "reorder"), _chance),
    "rate": _rate,
    "limit": lambda words: {"limit": words.value(_positive, "limit")},
    "trace": lambda words: {"trace": words.value(lambda path, field: Trace.read(Path(path), field), "trace")},
    "outage": _outage,
    "retransmit": lambda words: {"retransmit_s": words.value(parse_duration, "time")},
}


def _shape(text: str, field: str) -> Distribution:
    if text not in get_args(Distribution):
        raise ConfigurationError(f"{field} {text!r} is unknown; valid: {', '.join(get_args(Distribution))}")
    return cast(Distribution, text)


def _positive(text: str, field: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10 and int(text) > 0):
        raise ConfigurationError(f"{field}: {text!r}; valid: a whole number from 1 to 999999999")
    return int(text)


def _small_integer(text: str, field: str) -> int:
    digits = text.removeprefix("-")
    if not (digits.isascii() and digits.isdigit() and len(digits) < 6):
        raise ConfigurationError(f"{field}: {text!r}; valid: a whole number of bytes, up to five digits")
    return int(text)
