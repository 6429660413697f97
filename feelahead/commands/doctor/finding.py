"""Outcome of a check."""

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """Verdict of a check."""

    OK = "ok"
    NOTE = "note"
    """Optional: something is better, or possible, with it."""
    MISSING = "missing"
    """The checked thing does not work."""


@dataclass(frozen=True)
class Finding:
    """Outcome of one check."""

    name: str
    verdict: Verdict
    said: str
    """Finding in one line."""
    remedy: str | None = None
    """Command or change that mends it; None if nothing is to do."""


def can_be(side: str, findings: list[Finding]) -> bool:
    """Return whether this machine can be this side: it needs the extra of that name. The demo needs the robot side."""
    return any(finding.name == f"extra {side}" and finding.verdict is Verdict.OK for finding in findings)
