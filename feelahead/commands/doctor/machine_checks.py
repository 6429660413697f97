"""What the machine grants: priority, and the ports that the sides use by default."""

from collections.abc import Mapping, Sequence
from typing import Final

from feelahead.commands.doctor.finding import Finding, Verdict

PORTS: Final = {
    5555: "the control port of feelahead-robot; another one: --bind tcp://127.0.0.1:5557",
    5556: "the view port of feelahead-robot; another one: --view-bind tcp://127.0.0.1:5558",
    8080: "the console",
}
"""Each with what it is for, and how to use another."""


def check_realtime(platform: str, notes: Sequence[str]) -> list[Finding]:
    """Whether `--realtime` would be granted; `notes` are its own, one for each thing that is not."""
    if platform != "linux":
        return [Finding("--realtime", Verdict.NOTE, "Linux alone has it; the sides run without")]
    if not notes:
        return [Finding("--realtime", Verdict.OK, "permitted")]
    findings = []
    for note in notes:
        said, _, command = note.removeprefix("--realtime: ").partition("; to permit it: ")
        findings.append(Finding("--realtime", Verdict.NOTE, f"{said}; the sides run without", command or None))
    return findings


def check_ports(troubles: Mapping[int, str | None]) -> list[Finding]:
    """Whether the default ports can be bound on loopback; `troubles`: port -> why not, None if it can."""
    free = [str(port) for port, trouble in troubles.items() if trouble is None]
    findings = [Finding("ports", Verdict.OK, f"{', '.join(free)} are free")] if free else []
    for port, trouble in troubles.items():
        if trouble is not None:
            purpose, _, other = PORTS[port].partition("; another one: ")
            remedy = f"end whatever has it: ss -ltnp 'sport = :{port}'" + (
                f"; or use another: {other}" if other else ""
            )
            findings.append(Finding("ports", Verdict.NOTE, f"{port}, {purpose}: {trouble}", remedy))
    return findings
