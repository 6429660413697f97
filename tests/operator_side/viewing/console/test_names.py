"""Page and operator side use the same field names and codes; the page compares codes, never texts."""

import re
from typing import Final

import msgspec

from common.protocol.messages import Telemetry
from common.status.statuses import OperatorStatus
from operator_side.viewing.console.names import names
from operator_side.viewing.facts import DelayFacts, HandsFacts, OperatorFacts, TriggerFacts
from tests.helpers.repository import ROOT

_PLACE: Final = ROOT / "operator_side" / "viewing" / "console" / "page"
_SOURCES: Final = {path.name: path.read_text(encoding="utf-8") for path in _PLACE.glob("*.js")}
_TEXT: Final = r"""(?:"[^"\n]*"|'[^'\n]*'|`[^`\n]*`)"""
_COMPARED: Final = re.compile(
    rf"(?:[=!]==?|\bcase\b)\s*({_TEXT})|({_TEXT})\s*[=!]==?|\.(?:startsWith|endsWith|includes)\(\s*({_TEXT})"
)
_READ: Final = {
    r"\bfacts\??\.(\w+)": (OperatorFacts, TriggerFacts),  # triggers.js calls its own part the same.
    r"\bfacts\??\.page\??\.(\w+)": (HandsFacts,),
    r"\bhands\?\.(\w+)": (HandsFacts,),
    r"\bfacts\.to_(?:robot|operator)\.(\w+)": (DelayFacts,),
    r"\bstatus\??\.(\w+)": (OperatorStatus,),
    r"\bscreen\??\.(\w+)": (Telemetry,),
}
"""Expressions by which the page reads a struct, with the structs that they may be"""


def test_the_page_uses_only_codes_that_there_are() -> None:
    there = names()
    used = {name for source in _SOURCES.values() for name in re.findall(r"\b[A-Z][A-Za-z]+\.[A-Z_]{2,}\b", source)}
    used = {name for name in used if name.partition(".")[0] in there}
    assert len(used) > 10
    for name in used:
        of, _, code = name.partition(".")
        assert re.search(rf'{of} = .*"{code}": ', there), name


def test_the_page_compares_no_sentence() -> None:
    compared = [text for source in _SOURCES.values() for found in _COMPARED.findall(source) for text in found if text]
    assert '"running"' in compared  # The page's own codes: the search finds something.
    assert [text for text in compared if " " in text] == []


def test_the_page_reads_only_what_there_is() -> None:
    read = 0
    for pattern, structs in _READ.items():
        there = {one.encode_name for struct in structs for one in msgspec.structs.fields(struct)}
        for name, source in _SOURCES.items():
            found = set(re.findall(pattern, source))
            read += len(found)
            assert found <= there, (name, pattern)
    assert read > 30
