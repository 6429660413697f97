"""Text of a refusal."""

from collections.abc import Callable
from typing import Any

import pytest

from common.errors import ConfigurationError


def refusal(call: Callable[..., object], *arguments: Any) -> str:
    """Return the one line in which `call` refuses its arguments; fail on none or several."""
    with pytest.raises(ConfigurationError) as caught:
        call(*arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)
