"""Virtual controllers of each model and connection."""

from collections.abc import Iterator

import pytest

from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.reports.transport import Transport
from tests.kernel.inside.plugged import Plugged, Variant

_VARIANTS = [Variant(transport, model) for transport in Transport for model in Model]


@pytest.fixture(scope="session", params=_VARIANTS, ids=lambda variant: variant.name)
def plugged(request: pytest.FixtureRequest) -> Iterator[Plugged]:
    """Virtual controller, at first unplugged; a test plugs it in."""
    with Plugged(request.param) as one:
        yield one
