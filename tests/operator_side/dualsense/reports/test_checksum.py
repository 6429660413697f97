"""The checksum of Bluetooth reports, against values worked out bit by bit."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from operator_side.dualsense.reports.checksum import Seed, check, checksum, sealed

REPEATABLE = settings(derandomize=True, deadline=None)
REPORTS = st.binary(min_size=1, max_size=80)


def bitwise_crc32(content: bytes) -> int:
    """The textbook's: reflected, polynomial 0x04C11DB7."""
    register = 0xFFFFFFFF
    for byte in content:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (0xEDB88320 if register & 1 else 0)
    return register ^ 0xFFFFFFFF


def test_the_published_check_value() -> None:
    assert bitwise_crc32(b"123456789") == 0xCBF43926


@given(st.sampled_from(Seed), REPORTS)
@REPEATABLE
def test_it_covers_the_seed_and_the_content(seed: Seed, content: bytes) -> None:
    assert checksum(seed, content) == bitwise_crc32(bytes([seed]) + content)
    assert sealed(seed, content) == content + checksum(seed, content).to_bytes(4, "little")


@given(st.sampled_from(Seed), REPORTS, st.integers(0, 10_000))
@REPEATABLE
def test_any_single_wrong_bit_is_seen(seed: Seed, content: bytes, bit: int) -> None:
    report = sealed(seed, content)
    check(seed, report)
    wrong = bytearray(report)
    wrong[bit // 8 % len(report)] ^= 1 << bit % 8
    with pytest.raises(RemoteProtocolError, match="checksum 0x"):
        check(seed, bytes(wrong))


def test_another_kinds_seed_does_not_do() -> None:
    report = sealed(Seed.OUTPUT, b"\x31" + bytes(73))
    with pytest.raises(RemoteProtocolError, match=r"^input report: checksum"):
        check(Seed.INPUT, report)


@pytest.mark.parametrize("length", range(5))
def test_too_short_to_hold_one(length: int) -> None:
    with pytest.raises(RemoteProtocolError, match="feature write report"):
        check(Seed.FEATURE_WRITE, bytes(length))
