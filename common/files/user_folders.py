"""Folders of a person's settings and of caches, by each system's convention."""

import os
import sys
from collections.abc import Mapping
from pathlib import Path


def configuration_folder(
    platform: str = sys.platform, environment: Mapping[str, str] = os.environ, home: Path | None = None
) -> Path:
    """Return the folder of feelahead's configuration; it need not exist.

    Linux and others: $XDG_CONFIG_HOME/feelahead, else ~/.config/feelahead. macOS: the same if XDG_CONFIG_HOME is set,
    else ~/Library/Application Support/feelahead. Windows: %APPDATA%\\feelahead, else that under AppData\\Roaming.
    A relative path in a variable is ignored, as the XDG specification requires.
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
    """Return the folder of recomputable files: $XDG_CACHE_HOME/feelahead, else ~/.cache/feelahead."""
    given = Path(environment.get("XDG_CACHE_HOME", ""))
    return (given if given.is_absolute() else (Path.home() if home is None else home) / ".cache") / "feelahead"
