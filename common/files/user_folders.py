"""Folders of a user's settings and caches, by the convention of each operating system."""

import os
import sys
from collections.abc import Mapping
from pathlib import Path


def configuration_folder(
    platform: str = sys.platform, environment: Mapping[str, str] = os.environ, home: Path | None = None
) -> Path:
    """Return the folder of feelahead's configuration; it need not exist.

    Linux and others: $XDG_CONFIG_HOME/feelahead if that variable is set, else ~/.config/feelahead. macOS:
    $XDG_CONFIG_HOME/feelahead if set, else ~/Library/Application Support/feelahead. Windows: %APPDATA%\\feelahead if
    set, else ~\\AppData\\Roaming\\feelahead. A relative path in a variable is ignored, as the XDG specification
    requires.
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
    """Return the folder of files that can be made again: $XDG_CACHE_HOME/feelahead if set, else ~/.cache/feelahead."""
    given = Path(environment.get("XDG_CACHE_HOME", ""))
    return (given if given.is_absolute() else (Path.home() if home is None else home) / ".cache") / "feelahead"
