"""Check for the packages of extras, which a run does not need."""

from importlib.util import find_spec

from common.errors import ConfigurationError


def require_packages(what: str, *modules: str, extra: str = "record") -> None:
    """Raise ConfigurationError, with the command to install them, if `modules` are missing; imports none."""
    missing = [module for module in modules if find_spec(module) is None]
    if missing:
        raise ConfigurationError(f"{what}: {missing[0]} is not installed; pip install '.[{extra}]' in the clone")
