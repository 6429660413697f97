from pathlib import Path

import pytest

from common.errors import NoDeviceError
from operator_side.controllers import DEVICES, OpeningParts
from operator_side.core import OperatorSide
from operator_side.evdev import pad
from operator_side.settings import DEVICE_NAMES, OperatorSettings
from operator_side.viewing.pages.driving_page import DrivingPage
from tests.helpers.fake_hid import FakeBackend


def test_every_name_that_may_be_given_is_opened() -> None:
    assert set(DEVICE_NAMES) == DEVICES.keys()


@pytest.mark.parametrize("haptics", [True, False])
def test_a_controller_to_which_nothing_is_written_needs_no_watchdog(haptics: bool) -> None:
    parts = OpeningParts(OperatorSettings(haptics=haptics), OperatorSide(2, "clock"), DrivingPage(), FakeBackend({}))
    assert (DEVICES["hid"](parts).guard is not None) is haptics


def test_where_there_is_no_gamepad_it_says_what_would_be_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "event0").touch()  # Can be opened, but is no event node.
    monkeypatch.setattr(pad, "NODES", tmp_path)
    with pytest.raises(NoDeviceError, match=f"no gamepad with two sticks, two triggers and rumble in {tmp_path}$"):
        pad.find_pad(None)
