"""Optional dependency groups of the package (extras): whether they are installed, and how to install them."""

from importlib.util import find_spec
from pathlib import Path
from typing import Final

from common.errors import ConfigurationError

_CLONE: Final = (Path(__file__).parents[1] / "pyproject.toml").is_file()


def installing(extra: str | None, *, again: bool = False, clone: bool = _CLONE) -> str:
    """Return the command that installs extras, such as `robot,record`; for a wheel it is another one than in a clone.

    again: also what is installed already.
    """
    extras = f"[{extra}]" if extra else ""
    if clone:
        return f"pip install {'--force-reinstall ' if again else ''}'.{extras}'  # in the clone"
    if again:
        return f"pip install --force-reinstall 'FEELAHEAD.whl{extras}'  # the wheel that you installed"
    # No package of this name is published: pip takes the installed one.
    return f"pip install 'feelahead{extras}'"


def require_packages(what: str, *modules: str, extra: str = "record") -> None:
    """Raise ConfigurationError, with the command that installs `extra`, if one of `modules` is missing."""
    missing = [module for module in modules if find_spec(module) is None]
    if missing:
        raise ConfigurationError(f"{what}: {missing[0]} is not installed; to install it: {installing(extra)}")
