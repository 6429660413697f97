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


def fit_for_demo(findings: list[Finding]) -> bool:
    """Return whether the demo can run: it needs one extra."""
    return not any(finding.name == "extra robot" and finding.verdict is Verdict.MISSING for finding in findings)
