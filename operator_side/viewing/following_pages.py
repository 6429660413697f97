"""Hand on the words of the console's pages: hands to a controller, stops and wishes to the core."""

from operator_side.core import OperatorSide
from operator_side.viewing.console.console import Console
from operator_side.viewing.facts import HandsFacts
from operator_side.viewing.pages.driving_page import DrivingPage
from operator_side.viewing.pages.shared_hands import MovedHands


def hear_pages(console: Console, pages: DrivingPage, now_s: float) -> None:
    """Take what the pages of the console have said since the last call."""
    console.receive()
    while console.words:
        page, said = console.words.popleft()
        if said is None:
            pages.close(page, now_s)
        else:
            pages.receive(page, said, now_s)


def follow_pages(pages: DrivingPage, core: OperatorSide, now_s: float) -> None:
    """In every turn: a stop on a page counts like the controller's, and what a page wants tuned is asked for."""
    if pages.stopping(now_s):
        core.press_stop(now_s)
    if (wish := pages.take_wish()) is not None:
        core.tune(wish.probability, wish.link, now_s)


def hands_facts(pages: DrivingPage, shared: MovedHands | None, core: OperatorSide, now_s: float) -> HandsFacts:
    """Facts for the pages; `shared` None for a person's own."""
    rest_s = pages.rest_s(now_s)  # first, as it looks whether the page is still there
    return HandsFacts(
        may_drive=pages.may_drive,
        driver=pages.driver,
        readiness=pages.readiness,
        rest_s=rest_s,
        person=shared is not None and shared.has_person,
        doing=None if shared is None else shared.doing,
        tuning_refused=core.tuner.why,
        link_asked=core.tuner.link,
    )
