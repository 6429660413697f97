"""The packages of extras, which are not needed to run."""

from importlib.util import find_spec

from common.errors import ConfigurationError


def require_packages(what: str, *modules: str, extra: str = "record") -> None:
    """ConfigurationError with the command that mends it, unless every one of `modules` is there; none is imported."""
    missing = [module for module in modules if find_spec(module) is None]
    if missing:
        raise ConfigurationError(f"{what}: {missing[0]} is not installed; pip install 'feelahead[{extra}]'")
