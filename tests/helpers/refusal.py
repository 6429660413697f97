"""Text of the error with which a function refuses a setting."""

from collections.abc import Callable
from typing import Any

import pytest

from common.errors import ConfigurationError


def refusal(call: Callable[..., object], *arguments: Any) -> str:
    """Return the text of the ConfigurationError that `call` raises; fail if there is none or it has several lines."""
    with pytest.raises(ConfigurationError) as caught:
        call(*arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)
