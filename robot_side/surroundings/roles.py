"""Roles of objects, by their names or as a person chooses them."""

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
    """Return the role that the beginning of a name tells, in upper or lower case; OBSTACLE for any other name."""
    for prefix, role in _ROLE_OF_PREFIX.items():
        if name.lower().startswith(prefix):
            return role
    return Role.OBSTACLE


def assign_roles(names: Iterable[str], chosen: Mapping[str, Role]) -> dict[str, Role]:
    """Return each object's role: the chosen role, else the role that its name tells.

    ConfigurationError if `chosen` names an object that does not exist.
    """
    roles = {name: role_from_name(name) for name in names}
    for name in chosen:
        if name not in roles:
            raise ConfigurationError(f"roles: there is no object {name!r}; valid: {', '.join(roles) or 'none'}")
    return roles | dict(chosen)
