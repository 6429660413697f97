"""Links that can be given by name, such as wifi: their words, which the kernel must accept, and their round trips."""

import re
from typing import Any, get_args

import numpy as np
import pytest

from common.arrays import FloatArray
from common.command.run_options import RunOptions
from common.emulation.delay_line import DelayLine
from common.emulation.distribution import delays_at
from common.emulation.named_links import NAMED_LINKS
from common.emulation.spec import Direction, LinkSpec
from tests.helpers.repository import ROOT

every_link = pytest.mark.parametrize("name", NAMED_LINKS)
every_direction = pytest.mark.parametrize("direction", get_args(Direction))
NETEM_WORDS = re.compile(
    r"delay \d+(us|ms)( \d+(us|ms) distribution (normal|pareto|paretonormal))?"
    r"( loss ([\d.]+%|gemodel [\d.]+% [\d.]+%))? rate \d+[mg]bit"
)
"""Pattern of words that `tc` of iproute2 6.1 accepts in this order, and with units that mean the same to `tc`"""


@every_link
def test_a_name_stands_for_its_words(name: str) -> None:
    by_name, spelled_out = LinkSpec.parse(f" {name} ", 3, "stream"), LinkSpec.parse(NAMED_LINKS[name], 3, "stream")
    assert by_name == spelled_out
    assert RunOptions(link=name).link_spec().profile("to_robot").delay_s > 0.0


@every_link
@every_direction
def test_tc_takes_the_words_of_each_direction(name: str, direction: Direction) -> None:
    words = {
        part.rpartition(":")[0].strip() or direction: part.rpartition(":")[2].strip()
        for part in NAMED_LINKS[name].split(";")
    }
    assert NETEM_WORDS.fullmatch(words[direction])


@every_link
@every_direction
def test_nothing_is_overtaken_although_datagrams_may_be(name: str, direction: Direction) -> None:
    line: DelayLine[bytes] = DelayLine(LinkSpec.parse(name).profile(direction))
    for number in range(2000):
        line.push(1e-3 * number, b"a" * 300)
    while (due_s := line.next_due()) is not None:
        line.pop(due_s)
    assert line.figures.achieved()["late_share"] == 0.0


def round_trips_ms(name: str) -> FloatArray:
    """Draw round trips, in milliseconds, of packets so far apart that none waits for another."""
    generator, link = np.random.default_rng(1), LinkSpec.parse(name)
    profiles = [link.profile(direction) for direction in get_args(Direction)]
    ways = [delays_at(generator.random(100_000), one.delay_s, one.jitter_s, one.distribution) for one in profiles]
    total: FloatArray = 1e3 * (ways[0] + ways[1])
    return total


@pytest.mark.parametrize(
    ("name", "figure", "published_ms", "within_ms"),
    [
        ("wifi", lambda ms: np.quantile(ms, 0.5), 3.0, 1.0),
        ("wifi", lambda ms: np.quantile(ms, 0.9), 20.0, 3.0),
        ("lte", np.mean, 49.0, 1.0),
        ("lte", np.min, 40.0, 1.0),
        ("low-orbit", lambda ms: np.quantile(ms, 0.5), 50.0, 1.0),
        ("low-orbit", lambda ms: np.abs(np.diff(ms)).mean(), 6.7, 0.5),
        ("intercontinental", np.mean, 175.7, 1.0),
        ("satellite", np.mean, 600.0, 1.0),
    ],
)
def test_a_lone_packet_sees_what_was_published(name: str, figure: Any, published_ms: float, within_ms: float) -> None:
    assert figure(round_trips_ms(name)) == pytest.approx(published_ms, abs=within_ms)


def test_help_and_document_have_them_all() -> None:
    document = (ROOT / "docs" / "link.md").read_text(encoding="utf-8")
    for name, words in NAMED_LINKS.items():
        assert f"| `{name}` | `{words}` | " in document
    said = " ".join((ROOT / "common/command/run_options.py").read_text(encoding="utf-8").split())
    assert f"A name is valid, too: {', '.join(NAMED_LINKS)}." in said
