"""Answers that the participant's page keeps until the study has them."""

from dataclasses import asdict

import pytest

from feelahead.commands.study.server import PageServer
from feelahead.study.questionnaires import Item, questions
from feelahead.study.room import Page
from tests.console.browser import Browser

pytestmark = [pytest.mark.console, pytest.mark.processes]

TOKENS: dict[Page, str] = {"experimenter": "e" * 32, "participant": "p" * 32}


def test_answers_are_kept_for_their_participant_until_the_step_has_changed(browser: Browser) -> None:
    asked = [asdict(one) for one in questions(tlx=False, items=(Item("It helped."),))]
    common = {"study": "Small", "controller": "keyboard", "phase": None, "ready": False}

    with PageServer(0, TOKENS) as server:

        def show(participant: int, step: str) -> None:
            more = {"block": 1, "asked": asked} if step == "questions" else {}
            server.show("participant", {**common, "participant": participant, "step": step, **more})
            page.wait(f"document.querySelector('#card').dataset.step === '{step}'", step)

        def wait_for_answers(number: int) -> None:
            page.wait(f"document.querySelectorAll('form input:checked').length === {number}", f"{number} answers")

        with browser.page(server.address("participant"), (1280, 800)) as page:
            show(1, "questions")
            page.raw.click("[name=q0]")
            wait_for_answers(1)
            page.raw.click("form button.main")
            page.wait("Object.keys(sessionStorage).length === 1", "kept answers")  # the study may refuse them
            page.raw.reload()
            wait_for_answers(1)
            show(2, "questions")
            wait_for_answers(0)
            show(1, "pause")
            show(1, "questions")
            wait_for_answers(1)
            show(1, "rest")
            page.wait("Object.keys(sessionStorage).length === 0", "no answers")
            show(1, "questions")
            wait_for_answers(0)
