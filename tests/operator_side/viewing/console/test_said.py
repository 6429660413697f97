"""Words of the page's bar."""

import pytest
from msgspec.structs import replace

from operator_side.viewing.console.__main__ import said
from operator_side.viewing.facts import HandsFacts
from tests.operator_side.console_feed import facts

PAGE = HandsFacts(True, None, False, "", None)


@pytest.mark.parametrize(
    ("page", "shown"),
    [
        (replace(PAGE, reset_first=True), ("stopped", "STOPPED", (None, "a button"))),
        (PAGE, ("disarmed", "DISARMED", ("the stop was reset", None))),
        (replace(PAGE, may_drive=False), ("stopped", "STOPPED", (None, "a button"))),
        (None, ("stopped", "STOPPED", (None, "a button"))),
    ],
)
def test_a_stop_is_shown_until_a_page_resets_it(page: HandsFacts | None, shown: tuple[object, ...]) -> None:
    """A real controller has no reset: its stop is shown until it arms again."""
    words = said(replace(facts(0.0, "stopped"), page=page))
    assert (words["border"], words["state"], words["why"]) == shown
