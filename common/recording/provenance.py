"""Provenance of a run, needed for replay: settings, versions of packages, and the kind of machine."""

import dataclasses
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec

from common.errors import ConfigurationError

Settings = TypeVar("Settings")

_PACKAGES: Final = ("feelahead", "numpy", "scipy", "msgpack", "msgspec", "mujoco-core", "mujoco", "numba")
_OF_THIS_RUN: Final = ("summary", "record", "config", "keys")
"""Settings that have no effect on a core and are not recorded, because their files may no longer exist at replay."""


def provenance(settings: Any, epoch: int, clock_domain: str) -> dict[str, Any]:
    """Return all values from which a core was made, as values that JSON can hold."""
    kept = dataclasses.replace(settings, **{name: None for name in _OF_THIS_RUN if hasattr(settings, name)})
    return {
        "epoch": epoch,
        "clock_domain": clock_domain,
        "settings": msgspec.to_builtins(kept, enc_hook=_plain),
        "versions": {"python": platform.python_version(), **_versions()},
        "processor": processor_name(),
        "system": f"{platform.system()} {platform.machine()}",
    }


def settings_from(values: Mapping[str, Any], kind: type[Settings]) -> Settings:
    """Restore settings of type `kind` from the settings that `provenance` returned.

    Raises ConfigurationError if this version of feelahead rejects them.
    """
    try:
        return msgspec.convert(dict(values), kind, dec_hook=lambda want, value: want(value))
    except (msgspec.ValidationError, ValueError) as error:
        raise ConfigurationError(f"this version cannot read the recorded settings: {error}") from error


def _plain(value: object) -> object:
    if isinstance(value, Path):
        return str(value.absolute())
    return str(value)


def _versions() -> dict[str, str]:
    from importlib import metadata  # noqa: PLC0415  # loads the library for electronic mail

    found = {}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def processor_name() -> str:
    """Return the name of the processor; another processor may round differently."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "unknown")
