"""Finding of one check, and its verdict."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class Verdict(StrEnum):
    """Verdict of a check: works, could be better, or does not work."""

    OK = "ok"
    NOTE = "note"
    """The checked thing is optional: with it, something works better or becomes possible"""
    MISSING = "missing"
    """The checked thing does not work"""


COLOURS: Final = {Verdict.OK: "green", Verdict.NOTE: "yellow", Verdict.MISSING: "red"}


@dataclass(frozen=True)
class Finding:
    """Outcome of one check."""

    name: str
    verdict: Verdict
    said: str
    """What was found, in one line"""
    remedy: str | None = None
    """Command or change that mends the fault; None if there is nothing to do"""


def can_be(side: str, findings: list[Finding]) -> bool:
    """Return whether this machine can run `side` ("robot" or "operator"), which needs the extra of that name."""
    return any(finding.name == f"extra {side}" and finding.verdict is Verdict.OK for finding in findings)
