import random

from hypothesis import given
from hypothesis import strategies as st

from common.rate.pieces import HEAD_BYTES, LEAST_BYTES, Joining, piece_of

LIMIT_BYTES = 100_000


def pieces(whole: bytes, number: int, size_bytes: int) -> list[bytes]:
    return [piece_of(whole, number, offset, size_bytes) for offset in range(0, len(whole), size_bytes)]


@given(st.binary(min_size=1, max_size=5000), st.integers(LEAST_BYTES, 900), st.integers(0, 2**33), st.randoms())
def test_a_whole_comes_together_in_any_order(whole: bytes, size: int, number: int, chance: random.Random) -> None:
    joining = Joining(LIMIT_BYTES)
    parts = pieces(whole, number, size)
    chance.shuffle(parts)

    assert [joining.add(part) for part in parts] == [None] * (len(parts) - 1) + [whole]
    assert joining.rejected == joining.incomplete == 0


@given(st.lists(st.binary(min_size=400, max_size=3000), min_size=2, max_size=8), st.randoms())
def test_what_misses_a_piece_is_dropped_and_the_others_arrive(wholes: list[bytes], chance: random.Random) -> None:
    joining, arrived = Joining(LIMIT_BYTES), []
    lost = [chance.random() < 0.5 for _ in wholes]
    for number, (whole, loses) in enumerate(zip(wholes, lost, strict=True)):
        parts = pieces(whole, number, 150)
        if loses:
            del parts[chance.randrange(len(parts))]
        arrived += [out for part in parts if (out := joining.add(part)) is not None]

    assert arrived == [whole for whole, loses in zip(wholes, lost, strict=True) if not loses]
    assert sum(lost) - 2 <= joining.incomplete <= sum(lost)


@given(st.lists(st.binary(max_size=400), max_size=60))
def test_whatever_comes_memory_is_bounded(payloads: list[bytes]) -> None:
    joining = Joining(1000)
    for payload in payloads:
        whole = joining.add(payload)
        assert whole is None or len(whole) <= 1000
    assert len(joining._begun) <= 2


def test_hostile_pieces_are_rejected() -> None:
    whole = bytes(range(256)) * 4
    first, second = pieces(whole, 1, 512)
    for hostile in (
        b"",
        first[:HEAD_BYTES],
        first[: HEAD_BYTES + LEAST_BYTES - 1],
        piece_of(bytes(2 * LIMIT_BYTES), 2, 0, 512),
        second + b"more",
        piece_of(whole + b"longer", 1, 512, 512),
    ):
        joining = Joining(LIMIT_BYTES)
        assert joining.add(first) is None
        assert joining.add(hostile) is None
        assert joining.rejected == 1
        assert joining.add(second) == whole
    overlapping = Joining(LIMIT_BYTES)
    assert [overlapping.add(piece_of(whole, 1, offset, 512)) for offset in (0, 256, 512)] == [None, None, None]
    assert overlapping.rejected == 1
