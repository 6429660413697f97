"""The outcome of a check."""

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """A verdict."""

    OK = "ok"
    NOTE = "note"
    """Works without; something is better, or possible, with it."""
    MISSING = "missing"
    """The thing that was checked does not work."""


@dataclass(frozen=True)
class Finding:
    """One check's outcome."""

    name: str
    verdict: Verdict
    said: str
    """The finding in one line."""
    remedy: str | None = None
    """The command or change that mends it; None where there is nothing to do."""


def fit_for_demo(findings: list[Finding]) -> bool:
    """Whether everything is there that the demo needs: one extra."""
    return not any(finding.name == "extra robot" and finding.verdict is Verdict.MISSING for finding in findings)
