from pathlib import Path

import pytest

from common.files.user_folders import configuration_folder


@pytest.mark.parametrize(
    ("platform", "environment", "folder"),
    [
        ("linux", {}, "/home/someone/.config/feelahead"),
        ("linux", {"XDG_CONFIG_HOME": "/etc/mine"}, "/etc/mine/feelahead"),
        ("linux", {"XDG_CONFIG_HOME": "mine"}, "/home/someone/.config/feelahead"),
        ("linux", {"XDG_CONFIG_HOME": ""}, "/home/someone/.config/feelahead"),
        ("darwin", {}, "/home/someone/Library/Application Support/feelahead"),
        ("darwin", {"XDG_CONFIG_HOME": "/etc/mine"}, "/etc/mine/feelahead"),
        ("win32", {}, "/home/someone/AppData/Roaming/feelahead"),
        ("win32", {"APPDATA": "/roaming", "XDG_CONFIG_HOME": "/etc/mine"}, "/roaming/feelahead"),
    ],
)
def test_each_system_has_its_own(platform: str, environment: dict[str, str], folder: str) -> None:
    assert configuration_folder(platform, environment, Path("/home/someone")) == Path(folder)
