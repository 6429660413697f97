"""What a check comes to."""

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """How it stands."""

    OK = "ok"
    NOTE = "note"
    """Works without; something is better, or possible, with it."""
    MISSING = "missing"
    """What this check is about does not work as it is."""


@dataclass(frozen=True)
class Finding:
    """One check's outcome."""

    name: str
    verdict: Verdict
    said: str
    """What is the case, in one line."""
    remedy: str | None = None
    """What to do about it: a command, or what to change; None where there is nothing to do."""
    for_demo: bool = False
    """Whether `feelahead demo` cannot run without it."""


def fit_for_demo(findings: list[Finding]) -> bool:
    """Whether everything is there that the demo needs."""
    return not any(finding.for_demo and finding.verdict is Verdict.MISSING for finding in findings)
