"""Grammar of a link profile: that of netem, with further clauses for traces, outages and retransmission."""

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast, get_args

from common.emulation.clauses import Chance, LinkModel, Outage, Rate
from common.emulation.distribution import Distribution
from common.emulation.loss import GilbertElliott, LossModel, RandomLoss
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
        try:
            self._words = shlex.split(profile)
        except ValueError as error:
            raise ConfigurationError(f"link {spec!r}: {str(error).lower()}; valid: quotes in pairs") from error
        self._position = 0

    def peek(self) -> str | None:
        return self._words[self._position] if self._position < len(self._words) else None

    def take(self) -> str | None:
        word = self.peek()
        self._position += word is not None
        return word

    def take_if(self, word: str) -> bool:
        return self.peek() == word and self.take() is not None

    def number_follows(self, *, percent: bool) -> bool:
        word = self.peek()
        return bool(word) and (word or "")[0] in "0123456789+-." and (word or "").endswith("%") is percent

    def value(self, read: Callable[[str, str], _Value], clause: str, name: str) -> _Value:
        """Return the next word, parsed by `read`; raises ConfigurationError if there is none."""
        if (word := self.take()) is None:
            raise self.error(f"{clause!r} without {name}", clause)
        return read(word, f"link {self.spec!r}: {name}")

    def shares(self, clause: str, names: list[str]) -> list[float]:
        """Return the percentages that follow as shares: at least one, at most one for each of `names`."""
        shares = [self.value(parse_share, clause, names[0])]
        for name in names[1:]:
            if not self.number_follows(percent=True):
                break
            shares.append(self.value(parse_share, clause, name))
        return shares

    def error(self, what: str, clause: str | None = None) -> ConfigurationError:
        valid = GRAMMAR[clause] if clause else f"{GRAMMAR['delay']}, and {', '.join([*GRAMMAR][1:])}"
        return ConfigurationError(f"link {self.spec!r}: {what}; valid: {valid}")


def read_fields(profile: str, spec: str, model: LinkModel) -> dict[str, Any]:
    """Parse the words of `profile` into fields of `LinkProfile`. `spec`: the specification that contains `profile`.

    Raises ConfigurationError, in one line that quotes `spec`, for an invalid profile.
    """
    words = _Words(profile, spec)
    settings: dict[str, Any] = {}
    seen: set[str] = set()
    while (clause := words.take()) is not None:
        if clause not in _READERS:
            raise words.error(f"{clause!r} is unknown there")
        if clause in seen and clause != "outage":
            raise words.error(f"{clause!r} is there twice", clause)
        seen.add(clause)
        try:
            _READERS[clause](words, settings)
        except ConfigurationError:
            raise
        except ValueError as error:
            raise ConfigurationError(f"link {spec!r}: {clause}: {error}") from error
    if "trace" in seen and (other := seen & {"delay", "loss", "reorder"}):
        raise words.error(f"'trace' has its own delays and losses, and excludes {min(other)!r}", "trace")
    if "reorder" in seen and settings.get("delay_s", 0.0) == 0.0:
        raise words.error("'reorder' without a delay to overtake", "delay")
    if "retransmit" in seen and model != "stream":
        raise words.error("'retransmit' in the datagram model, which never sends again", "retransmit")
    return settings


def _read_delay(words: _Words, settings: dict[str, Any]) -> None:
    settings["delay_s"] = words.value(parse_duration, "delay", "delay")
    if words.number_follows(percent=False):
        settings["jitter_s"] = words.value(parse_duration, "delay", "jitter")
        if words.number_follows(percent=True):
            # Without effect, as in netem: its delays stay independent (measured lag-1 correlation 0).
            words.value(parse_share, "delay", "correlation")
    if words.take_if("distribution"):
        if "jitter_s" not in settings:
            raise words.error("'distribution' without a jitter to shape", "delay")
        settings["distribution"] = _read_shape(words)


def _read_shape(words: _Words) -> Distribution:
    name = words.take() or ""
    if name not in get_args(Distribution):
        raise ConfigurationError(
            f"link {words.spec!r}: distribution {name!r} is unknown; valid: {', '.join(get_args(Distribution))}"
        )
    return cast(Distribution, name)


def _read_loss(words: _Words, settings: dict[str, Any]) -> None:
    loss: LossModel
    if words.take_if("gemodel"):
        p, *rest = words.shares("loss", ["p", "r", "1-h", "1-k"])
        # One probability alone is independent loss: with r = 1 − p the next state does not depend on the last.
        loss = GilbertElliott(p, *(rest or [1.0 - p]))
    elif words.take_if("state"):
        raise ConfigurationError(f"link {words.spec!r}: 'loss state' is not emulated; valid: {GRAMMAR['loss']}")
    else:
        words.take_if("random")
        loss = RandomLoss(*words.shares("loss", ["probability", "correlation"]))
    settings["loss"] = loss


def _read_chance(name: str) -> Callable[[_Words, dict[str, Any]], None]:
    def read(words: _Words, settings: dict[str, Any]) -> None:
        settings[name] = Chance(*words.shares(name, ["probability", "correlation"]))

    return read


def _read_reorder(words: _Words, settings: dict[str, Any]) -> None:
    _read_chance("reorder")(words, settings)
    if words.take_if("gap"):
        settings["gap"] = words.value(_positive, "reorder", "gap")


def _read_rate(words: _Words, settings: dict[str, Any]) -> None:
    bits_per_second = words.value(parse_rate, "rate", "rate")
    overhead = words.value(_small_integer, "rate", "packet overhead") if words.number_follows(percent=False) else 0
    settings["rate"] = Rate(bits_per_second, overhead)


def _read_outage(words: _Words, settings: dict[str, Any]) -> None:
    duration_s = words.value(parse_duration, "outage", "duration")
    if not words.take_if("at"):
        raise words.error("'outage' without 'at' and a time", "outage")
    at_s = words.value(parse_duration, "outage", "begin")
    every_s = words.value(parse_duration, "outage", "period") if words.take_if("every") else None
    settings["outages"] = (*settings.get("outages", ()), Outage(duration_s, at_s, every_s))


def _read_value(
    clause: str, setting: str, name: str, read: Callable[[str, str], Any]
) -> Callable[[_Words, dict[str, Any]], None]:
    return lambda words, settings: settings.update({setting: words.value(read, clause, name)})


def _positive(text: str, field: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10 and int(text) > 0):
        raise ConfigurationError(f"{field}: {text!r}; valid: a whole number from 1 to 999999999")
    return int(text)


_READERS: dict[str, Callable[[_Words, dict[str, Any]], None]] = {
    "delay": _read_delay,
    "loss": _read_loss,
    "duplicate": _read_chance("duplicate"),
    "corrupt": _read_chance("corrupt"),
    "reorder": _read_reorder,
    "rate": _read_rate,
    "limit": _read_value("limit", "limit", "limit", _positive),
    "trace": _read_value("trace", "trace", "trace", lambda path, field: Trace.read(Path(path), field)),
    "outage": _read_outage,
    "retransmit": _read_value("retransmit", "retransmit_s", "time", parse_duration),
}


def _small_integer(text: str, field: str) -> int:
    digits = text.removeprefix("-")
    if not (digits.isascii() and digits.isdigit() and len(digits) < 6):
        raise ConfigurationError(f"{field}: {text!r}; valid: a whole number of bytes, up to five digits")
    return int(text)
