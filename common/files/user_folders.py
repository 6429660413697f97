"""Where a person's settings live, and what is kept from one run to the next, by each system's custom."""

import os
import sys
from collections.abc import Mapping
from pathlib import Path


def configuration_folder(
    platform: str = sys.platform, environment: Mapping[str, str] = os.environ, home: Path | None = None
) -> Path:
    """The folder of feelahead's own configuration; it need not exist.

    Linux and others: $XDG_CONFIG_HOME/feelahead, else ~/.config/feelahead. macOS: the same where XDG_CONFIG_HOME is
    set, else ~/Library/Application Support/feelahead. Windows: %APPDATA%\\feelahead, else that under AppData\\Roaming.
    A relative path in a variable is passed over, as the XDG specification wants it.
    """
    home = Path.home() if home is None else home
    if platform == "win32":
        variable, usual = "APPDATA", home / "AppData" / "Roaming"
    elif platform == "darwin":
        variable, usual = "XDG_CONFIG_HOME", home / "Library" / "Application Support"
    else:
        variable, usual = "XDG_CONFIG_HOME", home / ".config"
    given = Path(environment.get(variable, ""))
    return (given if given.is_absolute() else usual) / "feelahead"


def cache_folder(environment: Mapping[str, str] = os.environ, home: Path | None = None) -> Path:
    """The folder of what can be worked out again: $XDG_CACHE_HOME/feelahead, else ~/.cache/feelahead."""
    given = Path(environment.get("XDG_CACHE_HOME", ""))
    return (given if given.is_absolute() else (Path.home() if home is None else home) / ".cache") / "feelahead"
