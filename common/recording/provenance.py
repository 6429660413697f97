"""Provenance of a run: settings, versions and the kind of machine, for replay."""

import dataclasses
import importlib.metadata
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec

from common.errors import ConfigurationError

Settings = TypeVar("Settings")

_PACKAGES: Final = ("feelahead", "numpy", "scipy", "msgpack", "msgspec", "mujoco-core", "mujoco", "numba")
_OF_THIS_RUN: Final = ("summary", "record", "config", "keys")
"""Settings without effect on a core; their files may be gone later."""


def provenance(settings: Any, epoch: int, clock_domain: str) -> dict[str, Any]:
    """Return all values from which a core was made, as plain ones."""
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
    """Restore the settings from `provenance`; raises ConfigurationError if this version rejects them."""
    try:
        return msgspec.convert(dict(values), kind, dec_hook=lambda want, value: want(value))
    except (msgspec.ValidationError, ValueError) as error:
        raise ConfigurationError(f"the recorded settings are not this version's: {error}") from error


def _plain(value: object) -> object:
    if isinstance(value, Path):
        return str(value.absolute())
    return str(value)


def _versions() -> dict[str, str]:
    found = {}
    for name in _PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def processor_name() -> str:
    """Return the processor's name: another one may round differently."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "unknown")
