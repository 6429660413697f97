import re
from typing import get_args

import pytest

from common.command.run_options import RunOptions
from common.emulation.delay_line import DelayLine
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


def test_help_and_document_have_them_all() -> None:
    document = (ROOT / "docs" / "link.md").read_text(encoding="utf-8")
    for name, words in NAMED_LINKS.items():
        assert f"| `{name}` | `{words}` | " in document
    said = " ".join((ROOT / "common/command/run_options.py").read_text(encoding="utf-8").split())
    assert f"A name is valid, too: {', '.join(NAMED_LINKS)}." in said
