import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.emulation.delay_line import DelayLine
from common.emulation.profile import LinkProfile
from common.emulation.spec import LinkSpec
from common.emulation.tuned import tunable_profile, tuned_link
from common.errors import ConfigurationError
from tests.helpers.refusal import refusal


@pytest.mark.parametrize(
    ("words", "delay_s", "jitter_s", "loss"),
    [
        ("", 0.0, 0.0, 0.0),
        ("delay 50ms", 0.05, 0.0, 0.0),
        ("delay 400ms 50ms distribution normal loss 10%", 0.4, 0.05, 0.1),
        ("loss 2.5%", 0.0, 0.0, 0.025),
    ],
)
def test_delay_jitter_and_loss_are_tuned(words: str, delay_s: float, jitter_s: float, loss: float) -> None:
    profile = tuned_link(LinkSpec.parse("delay 1s loss 50%", seed=3), words).profile("to_robot")
    assert (profile.delay_s, profile.jitter_s) == (delay_s, jitter_s)
    assert (0.0 if profile.loss is None else profile.loss.share()) == loss


@pytest.mark.parametrize(
    "words",
    [
        "delay 501ms",
        "delay 10ms 101ms",
        "loss 21%",
        "trace /etc/passwd",
        "delay 10ms 1ms distribution /etc/passwd",
        "outage 2s at 1s",
        "to_robot: delay 1ms",
        "wifi",
        "delay -1ms",
    ],
)
def test_nothing_else_is_tuned(words: str) -> None:
    refusal(tunable_profile, words)


@given(st.text(max_size=50))
def test_any_words_are_granted_or_refused_in_one_line(words: str) -> None:
    try:
        profile = tunable_profile(words)
    except ConfigurationError:
        return
    assert profile.delay_s <= 0.5
    assert profile.trace is None


def test_streams_keep_what_was_asked_for_them() -> None:
    link = LinkSpec.parse("to_robot: delay 20ms; haptics: delay 30ms; video: rate 2mbit", 1, "stream")
    tuned = tuned_link(link, "delay 5ms")
    assert tuned.profile("to_robot").delay_s == tuned.profile("to_operator").delay_s == 0.005
    assert tuned.profile("to_operator", "video").rate == link.profile("to_operator", "video").rate
    assert tuned.profile("to_robot").model == "stream"


def test_what_waits_leaves_when_it_was_due_and_what_comes_follows_the_new_profile() -> None:
    line: DelayLine[bytes] = DelayLine(LinkProfile.parse("delay 100ms"))
    line.push(0.0, b"old")
    line.change(LinkProfile.parse("delay 10ms"))
    line.push(0.001, b"new")
    assert line.pop(0.0111) == [b"new"]
    assert line.pop(0.0999) == []
    assert line.pop(0.1) == [b"old"]
    assert line.figures.sent == 2
    assert line.summary()["asked"] == "delay 10ms"
