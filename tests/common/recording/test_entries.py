"""Blocks of entries keep every byte, and what is none is told."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.recording.entries import Entry, Kind, entry, pack_block, split_text, text, unpack_block

ENTRIES = st.lists(
    st.builds(
        Entry,
        st.sampled_from(Kind),
        st.floats(allow_nan=False),
        st.binary(max_size=300),
    ),
    max_size=20,
)


@given(ENTRIES, st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
def test_what_is_packed_is_unpacked(entries: list[Entry], number: int, dropped: int) -> None:
    packed = b"".join(entry(Kind(one.kind), one.now_s, one.content[:1], one.content[1:]) for one in entries)
    block = unpack_block(pack_block(number, dropped, 1.0, 2.0, packed))
    assert (block.number, block.dropped, block.first_s, block.last_s) == (number, dropped, 1.0, 2.0)
    assert list(block.unpacked()) == entries


@given(ENTRIES.filter(bool), st.data())
def test_a_block_that_ends_within_an_entry_is_refused(entries: list[Entry], data: st.DataObject) -> None:
    packed = b"".join(entry(Kind(one.kind), one.now_s, one.content) for one in entries)
    last = len(entry(Kind(entries[-1].kind), entries[-1].now_s, entries[-1].content))
    end = data.draw(st.integers(len(packed) - last + 1, len(packed) - 1))
    with pytest.raises(ValueError, match="ends within one"):
        list(unpack_block(pack_block(0, 0, 0.0, 0.0, packed[:end])).unpacked())


@given(st.binary(max_size=255), st.binary(max_size=100))
def test_text_before_bytes(short: bytes, rest: bytes) -> None:
    assert split_text(text(short) + rest) == (short, rest)
    with pytest.raises(ValueError, match="ends within"):
        split_text((text(short) + rest)[: len(short)] if short else b"")
