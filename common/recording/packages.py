"""Check that the packages of an optional dependency group (an extra) are installed."""

from importlib.util import find_spec

from common.errors import ConfigurationError


def require_packages(what: str, *modules: str, extra: str = "record") -> None:
    """Raise ConfigurationError, with the command that installs `extra`, if one of `modules` is missing."""
    missing = [module for module in modules if find_spec(module) is None]
    if missing:
        remedy = f"install it in the clone: pip install '.[{extra}]'"
        raise ConfigurationError(f"{what}: {missing[0]} is not installed; {remedy}")
