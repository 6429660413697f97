"""What the machine grants: priority, and the ports that the sides use by default."""

import sys
from collections.abc import Mapping, Sequence
from typing import Final

from feelahead.commands.doctor.finding import Finding, Verdict

RENDERING: Final = ("egl", "osmesa") if sys.platform == "linux" else ("",)
"""As robot_side/cameras tries them."""
RENDERING_PACKAGES: Final = "sudo apt-get install libegl1 libgl1-mesa-dri (or: libosmesa6)"
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


def check_rendering(troubles: Mapping[str, str | None]) -> Finding:
    """Whether the cameras' pictures can be rendered; `troubles`: way to render -> why not, None if it works."""
    working = [name for name, trouble in troubles.items() if trouble is None]
    if working:
        return Finding("cameras", Verdict.OK, f"rendered without a screen by way of {working[0].upper() or 'OpenGL'}")
    said = "; ".join(trouble for trouble in troubles.values() if trouble is not None)
    remedy = RENDERING_PACKAGES if "egl" in troubles else None
    return Finding("cameras", Verdict.NOTE, f"no pictures, the arm is driven without: {said}", remedy)


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
