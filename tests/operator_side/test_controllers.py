from pathlib import Path
from typing import get_args

import pytest

from common.errors import NoDeviceError
from operator_side.controllers import DEVICES
from operator_side.evdev import pad
from operator_side.settings import DeviceName


def test_every_name_that_may_be_given_is_opened() -> None:
    assert set(get_args(DeviceName)) == DEVICES.keys()


def test_where_there_is_no_gamepad_it_says_what_would_be_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "event0").touch()  # Can be opened, but is no event node.
    monkeypatch.setattr(pad, "NODES", tmp_path)
    with pytest.raises(NoDeviceError, match=f"no gamepad with two sticks, two triggers and rumble in {tmp_path}$"):
        pad.find_pad(None)
