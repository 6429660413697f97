import pytest

from common.sockets.greeting import KNOCK, mechanism_of


def greeting(mechanism: bytes) -> bytes:
    return KNOCK + mechanism.ljust(20, b"\0") + bytes(32)


@pytest.mark.parametrize("mechanism", ["NULL", "CURVE", "PLAIN"])
def test_a_greeting_names_the_mechanism(mechanism: str) -> None:
    assert mechanism_of(greeting(mechanism.encode())) == mechanism


@pytest.mark.parametrize(
    "said",
    [
        b"",
        KNOCK,
        greeting(b"NULL")[:63],
        b"HTTP/1.1 400 Bad Request".ljust(64),
        KNOCK[:10] + b"\x01" + greeting(b"NULL")[11:],
        b"\xff" + bytes(63),
    ],
)
def test_anything_else_names_none(said: bytes) -> None:
    assert mechanism_of(said) is None
