import math
import secrets
from pathlib import Path

import pytest

from operator_side.hands.travel_calibration import StickRest, TriggerTravel
from operator_side.settings import OperatorSettings


@pytest.mark.parametrize(
    ("kind", "name", "values"),
    [
        (TriggerTravel, "dead_zone", (-0.1, 0.98, 1.5)),
        (TriggerTravel, "saturation", (0.05, 0.0, 1.1)),
        (StickRest, "dead_zone", (-0.1, 1.0)),
        *((StickRest, name, (-0.31, 0.31)) for name in ("x", "y")),
        (OperatorSettings, "duration", (0.0, -2.0)),
    ],
)
def test_what_is_checked_by_hand_is_named_with_what_is_valid(kind: type, name: str, values: tuple[float, ...]) -> None:
    for value in (*values, math.nan, math.inf):
        with pytest.raises(ValueError, match=rf"{name}\b.*{value}.*valid"):
            kind(**{name: value})


def test_a_stick_that_rests_aside_has_a_smaller_dead_zone() -> None:
    StickRest(x=0.12, y=-0.16, dead_zone=0.79)
    with pytest.raises(ValueError, match=r"dead_zone = 0\.81; valid: 0 to below 0\.8"):
        StickRest(x=0.12, y=-0.16, dead_zone=0.81)


@pytest.mark.parametrize(("text", "seconds"), [("0ms", 0.0), ("12ms", 0.012), ("-12ms", -0.012), ("-2s", -2.0)])
def test_an_asymmetry_has_a_sign(text: str, seconds: float) -> None:
    assert OperatorSettings(asymmetry=text).asymmetry_s() == pytest.approx(seconds)


@pytest.mark.parametrize("content", [None, b"", b"a" * 21, "é".encode() * 22, b"../" + b"a" * 22, b"a" * 22 + b"\nb"])
def test_a_token_that_could_be_guessed_or_is_no_part_of_an_address_is_refused(
    tmp_path: Path, content: bytes | None
) -> None:
    path = tmp_path / "token"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ValueError, match=r"--console-token .*token; valid: a file with 22"):
        OperatorSettings(console_token=path)
    path.write_text(secrets.token_urlsafe(16) + "\n")
    assert OperatorSettings(console_token=path).console_token == path


def test_the_address_to_go_back_to_is_in_a_file(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"--console-back .*back: there is no such file; valid: an existing file"):
        OperatorSettings(console_back=tmp_path / "back")
