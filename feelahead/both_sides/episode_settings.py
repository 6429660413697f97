"""Settings of an episode: those of both sides by their names, without what only processes have."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np

from common.command.command_line import settings_of
from common.emulation.spec import clause_names
from common.errors import ConfigurationError
from common.files.plugged import object_name
from common.link_model import LinkProfile
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings

_Settings = TypeVar("_Settings", RobotSettings, OperatorSettings)
_OF_PROCESSES: Final = {
    *("arm", "asymmetry", "audit", "bind", "cameras", "config", "connect", "connections", "console", "console_port"),
    *("console_token", "controller", "device", "duration", "insecure", "keys", "law", "objects", "perception"),
    *("depth", "pictures"),
    *("person", "person_file", "person_waits", "pull_n", "realtime", "record", "robot_key", "status", "summary", "tui"),
    *("view_bind", "view_connect"),
}
"""Settings of processes, sockets and terminals, and those that are arguments of their own"""
_SETTINGS: Final = (RobotSettings.__dataclass_fields__ | OperatorSettings.__dataclass_fields__).keys() - _OF_PROCESSES


def require_settings(names: Collection[str]) -> None:
    """Raise ConfigurationError if a name is no setting of an episode."""
    if unknown := set(names) - _SETTINGS:
        valid = sorted(_SETTINGS | {"law", "person", "perception", "arm"})
        near = [found for name in sorted(unknown) for found in get_close_matches(name, valid, 1)]
        meant = f" (perhaps {', '.join(near)})" if near else ""
        raise ConfigurationError(
            f"Episode: {', '.join(sorted(unknown))}: no such setting{meant}; valid: {', '.join(valid)}"
        )


def side_settings(kind: type[_Settings], base: _Settings | None, given: Mapping[str, Any]) -> _Settings:
    """Return a side's settings: those of `given` that it has, on top of `base`; ConfigurationError for a bad value."""
    plain = {name: value.item() if isinstance(value, np.generic) else value for name, value in given.items()}
    mine = {name: value for name, value in plain.items() if name in kind.__dataclass_fields__}
    return settings_of(mine, kind, "Episode") if base is None else replace(base, **mine)


def link_clauses(link: LinkProfile | Mapping[str, LinkProfile]) -> Mapping[str, LinkProfile]:
    """Return the clauses of a `LinkSpec`; ConfigurationError for something else."""
    clauses = {"": link} if isinstance(link, LinkProfile) else link
    if not isinstance(clauses, Mapping) or not all(isinstance(one, LinkProfile) for one in clauses.values()):
        raise ConfigurationError(
            f"Episode: link is of type {type(link).__name__}; valid: netem's words, a LinkProfile, or these by name"
        )
    if unknown := clauses.keys() - set(clause_names()):
        valid = ", ".join(filter(None, clause_names()))
        raise ConfigurationError(f"Episode: link: {', '.join(sorted(unknown))}: no such direction; valid: {valid}")
    return clauses


def absolute(part: object) -> object:
    """Return a part that is named; a file by its whole path, so that it is found from any folder later."""
    if not isinstance(part, str | Path):
        return part
    is_file = str(part).endswith(".py") and Path(part).is_file()
    return str(Path(part).absolute()) if is_file else str(part)


def law_setting(law: object) -> dict[str, str]:
    """Return the robot side's setting that names the law; an object by what it is."""
    return {} if law is None else {"law": law if isinstance(law, str) else object_name(law)}
