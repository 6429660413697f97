from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.emulation.clauses import Chance, Outage, Rate
from common.emulation.loss import GilbertElliott, RandomLoss
from common.emulation.profile import LinkProfile
from common.emulation.spec import LinkSpec
from common.errors import ConfigurationError
from tests.helpers.refusal import refusal


@pytest.mark.parametrize(
    ("spec", "expected"),
    [
        ("", LinkProfile()),
        ("delay 50ms", LinkProfile(0.050)),
        ("delay 50ms 10ms", LinkProfile(0.050, 0.010, "uniform")),
        (" delay  0.2s 1500us   distribution normal ", LinkProfile(0.2, 0.0015, "normal")),
        ("delay 50ms 10ms 5% distribution pareto", LinkProfile(0.050, 0.010, "pareto")),
        ("loss random 1% 25%", LinkProfile(loss=RandomLoss(0.01, 0.25))),
        ("loss gemodel 1% 25% 80% 0.1%", LinkProfile(loss=GilbertElliott(0.01, 0.25, 0.8, 0.001))),
        ("duplicate 1% 5% corrupt 2%", LinkProfile(duplicate=Chance(0.01, 0.05), corrupt=Chance(0.02))),
        ("delay 5ms reorder 25% 50% gap 5", LinkProfile(0.005, reorder=Chance(0.25, 0.5), gap=5)),
        ("rate 1mbps", LinkProfile(rate=Rate(8e6))),
        ("rate 500kbit -14", LinkProfile(rate=Rate(500e3, -14))),
        ("limit 7", LinkProfile(limit=7)),
        (
            "outage 2s at 10s every 30s outage 1s at 0s",
            LinkProfile(outages=(Outage(2.0, 10.0, 30.0), Outage(1.0, 0.0))),
        ),
        ("rate 2mbit loss 1% delay 5ms", LinkProfile(0.005, loss=RandomLoss(0.01), rate=Rate(2e6))),
    ],
)
def test_reads_netem_and_keeps_the_words(spec: str, expected: LinkProfile) -> None:
    profile = LinkProfile.parse(spec)
    assert profile == expected
    assert profile.words == " ".join(spec.split())


WORDS = (
    *("delay", "5ms", "10ms", "25%", "distribution", "normal", "pareto", "loss", "state", "gemodel", "random"),
    *("duplicate", "corrupt", "reorder", "gap", "3", "rate", "1mbit", "limit", "slot", "outage", "at", "every"),
    *("2s", "trace", "x.csv", "retransmit", "'", '"', ";", ":", "to_robot:", "é", "-1", "٣"),
)


@pytest.mark.parametrize(
    ("spec", "named", "valid"),
    [
        ("50ms", "'50ms'", "delay TIME"),
        ("delay 50", "'50'", "50ms"),
        ("delay -50ms", "'-50ms'", "0s or longer"),
        ("delay 50ms 10ms 101%", "'101%'", "0% to 100%"),
        ("delay 50ms distribution normal", "'distribution'", "delay TIME"),
        ("delay 50ms 10ms distribution gauss", "'gauss'", "uniform, normal"),
        ("loss", "'loss' is given without probability", "loss [random]"),
        ("reorder 25%", "'reorder' is given without a delay", "delay TIME"),
        ("delay 1ms reorder 25% gap 0", "'0'", "from 1"),
        ("rate 0mbit", "'0mbit'", "more than 0bit"),
        ("rate 1e-320bit", "", "valid"),
        ("delay 1e308s", "", "valid"),
        ("delay 2000000s", "delay_s = ", "0 to 1000000"),
        ("rate 10mbit 1.5", "'1.5'", "whole number"),
        ("trace nowhere.csv", "'nowhere.csv'", "delay_ns"),
        ("outage 2s", "'outage' is given without 'at'", "outage DURATION at TIME"),
        ("outage 0s at 1s", "duration_s = 0.0", "above 0"),
        ("loss state 1%", "'loss state'", "gemodel"),
        ("delay 5ms 1ms distribution my.dist", "'my.dist'", "paretonormal, exponential"),
        ("outage 2s at 1s every 2s", "every 2.0 s", "longer than an outage lasts, 2 s"),
        ("retransmit 200ms", "'retransmit'", "retransmit TIME"),
        ("delay 50ms 'loss", "no closing quotation", "quotes in pairs"),
        ("to_robot: delay 50ms", "'to_robot:'", "delay TIME"),
    ],
)
def test_refuses_a_bad_profile_in_one_line(spec: str, named: str, valid: str) -> None:
    text = refusal(LinkProfile.parse, spec)
    assert repr(spec) in text
    assert named in text.replace(repr(spec), "", 1)
    assert valid in text


@given(
    st.lists(
        st.sampled_from(WORDS),
        max_size=8,
    )
)
def test_whatever_is_said_is_read_or_refused_in_one_line(words: list[str]) -> None:
    for parse in (LinkProfile.parse, LinkSpec.parse):
        complaint = ""
        try:
            parse(" ".join(words), 0, "stream")
        except ConfigurationError as error:
            complaint = str(error)
        assert "\n" not in complaint


def test_refuses_unknown_models_and_negative_seeds() -> None:
    for parse in (LinkProfile.parse, LinkSpec.parse):
        with pytest.raises(ConfigurationError, match="'tcp' is unknown; valid: datagram, stream"):
            parse("", model="tcp")  # type: ignore[arg-type]
        with pytest.raises(ConfigurationError, match="seed = -1"):
            parse("", seed=-1)


def test_a_files_name_may_hold_a_colon(tmp_path: Path) -> None:
    path = tmp_path / "a:b.csv"
    path.write_text("delay_ns\n1000000\n")
    spec = LinkSpec.parse(f"trace {path}")
    assert spec.profile("to_robot").mean_delay_s() == pytest.approx(1e-3)
