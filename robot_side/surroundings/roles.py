"""What an object is to the task, from its name or from what a person said."""

from collections.abc import Iterable, Mapping

from common.errors import ConfigurationError
from common.roles import Role

_ROLE_OF_PREFIX = {
    "target": Role.TARGET,
    "support": Role.SUPPORT,
    "table": Role.SUPPORT,
    "floor": Role.SUPPORT,
}


def role_from_name(name: str) -> Role:
    """The role that a name's beginning tells, in upper or lower case; an obstacle where it tells none."""
    for prefix, role in _ROLE_OF_PREFIX.items():
        if name.lower().startswith(prefix):
            return role
    return Role.OBSTACLE


def assign_roles(names: Iterable[str], chosen: Mapping[str, Role]) -> dict[str, Role]:
    """Each object's role: the chosen one, else the one its name tells.

    ConfigurationError when `chosen` names an object that is not there.
    """
    roles = {name: role_from_name(name) for name in names}
    for name in chosen:
        if name not in roles:
            raise ConfigurationError(f"roles: there is no object {name!r}; valid: {', '.join(roles) or 'none'}")
    return roles | dict(chosen)
