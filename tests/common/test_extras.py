"""How extras are installed, in a clone and from a wheel."""

import re

import pytest

from common.errors import ConfigurationError
from common.extras import installing, require_packages


def test_the_command_fits_how_feelahead_was_installed() -> None:
    assert installing("robot", clone=True) == "pip install '.[robot]'  # in the clone"
    assert installing(None, clone=True, again=True) == "pip install --force-reinstall '.'  # in the clone"
    assert installing("robot,record", clone=False) == "pip install 'feelahead[robot,record]'"
    assert "FEELAHEAD.whl[robot]" in installing("robot", clone=False, again=True)


def test_a_missing_package_is_named_with_its_extra() -> None:
    with pytest.raises(ConfigurationError, match=rf"^plot: no_such is not .*{re.escape(installing('study'))}$"):
        require_packages("plot", "json", "no_such", extra="study")
