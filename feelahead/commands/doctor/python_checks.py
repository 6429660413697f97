"""Python and the packages that each part of feelahead needs."""

import re
from collections.abc import Mapping
from typing import Final

from feelahead.commands.doctor.finding import Finding, Verdict

OLDEST_PYTHON: Final = (3, 11)

EXTRAS: Final[Mapping[str, tuple[str, ...]]] = {
    "robot": ("mujoco", "numba", "simplejpeg"),
    "operator": ("hidapi", "viser"),
    "record": ("foxglove", "mcap"),
    "experiments": ("matplotlib", "pyarrow", "distributed"),
}
"""Each extra with what it brings; hidapi's module is `hidraw` on Linux and `hid` elsewhere."""
_PACKAGES: Final = {"mujoco": "mujoco-core", "hidraw": "hidapi", "hid": "hidapi", "foxglove": "foxglove-sdk"}
"""What brings a module, where its name is another."""
_PURPOSES: Final = {
    "robot": "the simulated arm: the demo and feelahead-robot",
    "operator": "a real controller and the browser console",
    "record": "recording runs",
    "experiments": "sweeps over many runs",
}
_FOR_DEMO: Final = frozenset({"robot"})


def modules_of(extra: str, platform: str) -> tuple[str, ...]:
    """What to import to see whether an extra is there; `platform` as in sys.platform."""
    hidapi = "hidraw" if platform == "linux" else "hid"
    return tuple(hidapi if module == "hidapi" else module for module in EXTRAS[extra])


def check_python(version: tuple[int, int, int]) -> Finding:
    """Whether this Python is new enough."""
    said = ".".join(map(str, version))
    if version[:2] >= OLDEST_PYTHON:
        return Finding("Python", Verdict.OK, said, for_demo=True)
    oldest = ".".join(map(str, OLDEST_PYTHON))
    return Finding(
        "Python", Verdict.MISSING, f"{said}, older than {oldest}", f"install Python {oldest} or later", for_demo=True
    )


def check_extra(extra: str, failures: Mapping[str, str]) -> Finding:
    """Whether every module of an extra could be imported; `failures`: what Python said of those that could not."""
    name, for_demo = f"extra {extra}", extra in _FOR_DEMO
    if not failures:
        return Finding(name, Verdict.OK, f"{', '.join(EXTRAS[extra])}: {_PURPOSES[extra]}", for_demo=for_demo)
    absent = [module for module, reason in failures.items() if re.search(r"No module named", reason)]
    broken = [f"{module} ({reason})" for module, reason in failures.items() if module not in absent]
    said = "; ".join(
        part
        for part in (
            f"not installed: {', '.join(absent)}" if absent else "",
            f"cannot be imported: {', '.join(broken)}" if broken else "",
        )
        if part
    )
    again = " ".join(_PACKAGES.get(module, module) for module in failures)
    return Finding(
        name,
        Verdict.MISSING if for_demo else Verdict.NOTE,
        f"{said} (for {_PURPOSES[extra]})",
        f"pip install --force-reinstall {again}" if broken else f"pip install 'feelahead[{extra}]'",
        for_demo=for_demo,
    )
