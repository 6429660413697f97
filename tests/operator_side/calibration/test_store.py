import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import ConfigurationError
from operator_side.calibration.store import calibration_path, load_calibration, read_calibration, write_calibration
from operator_side.hands.travel_calibration import StickRest, TravelCalibration, TriggerTravel
from tests.helpers.refusal import refusal

ADDRESS = "aa:bb:cc:00:11:22"
MEASURED = TravelCalibration(TriggerTravel(0.06, 0.91), TriggerTravel(0.03, 0.98), StickRest(0.02, -0.01, 0.08))
TRIGGERS = st.builds(TriggerTravel, st.floats(0.0, 0.3), st.floats(0.5, 1.0))
STICKS = st.builds(StickRest, st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(0.0, 0.6))


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    return tmp_path


def test_what_was_stored_is_loaded_for_that_controller_alone(own_folder: Path) -> None:
    assert load_calibration(ADDRESS) is None
    path = calibration_path(ADDRESS)
    write_calibration(path, ADDRESS, MEASURED)
    assert path == own_folder / "feelahead" / "controllers" / "aa-bb-cc-00-11-22.toml"
    assert load_calibration(ADDRESS) == MEASURED
    assert load_calibration("aa:bb:cc:00:11:23") is None
    assert [file.name for file in path.parent.iterdir()] == [path.name]


@given(st.builds(TravelCalibration, TRIGGERS, TRIGGERS, STICKS, STICKS))
def test_every_calibration_is_read_as_it_was_written(calibration: TravelCalibration) -> None:
    path = calibration_path(ADDRESS)
    write_calibration(path, ADDRESS, calibration)
    assert read_calibration(path) == (ADDRESS, calibration)


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("version = 1", "version = 2", "version = 2"),
        ("version = 1\n", "", "missing required field `version`"),
        ("dead_zone = 0.06", "dead_zone = 0.95", "l2: dead_zone = 0.95"),
        ("dead_zone = 0.06", "dead_zone = true", "l2.dead_zone = true"),
        ("dead_zone = 0.06", "", "l2.dead_zone is missing"),
        ("saturation = 0.91", "saturation = 0.91\nsaturated = 1", "l2.saturated is unknown"),
        ("[l2]", "[l3]", "missing required field `l2`"),
        ("x = 0.02", "x = 0.5", "left_stick: x = 0.5"),
        ("aa:bb:cc:00:11:22", "AA:BB", "address = 'AA:BB'"),
        ("aa:bb:cc:00:11:22", "aa:bb:cc:00:11:23", "address = 'aa:bb:cc:00:11:23'; valid: aa:bb:cc:00:11:22"),
        ("#", "#" * 20_000, "too large; valid: up to 10000 bytes"),
    ],
)
def test_a_broken_file_is_named_in_one_line_with_what_mends_it(old: str, new: str, named: str) -> None:
    path = calibration_path(ADDRESS)
    write_calibration(path, ADDRESS, MEASURED)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    said = refusal(load_calibration, ADDRESS)
    assert named in said
    assert str(path) in said
    assert "feelahead controller --calibrate" in said
    assert len(said) < 500


def test_what_cannot_be_read_is_refused_without_waiting(own_folder: Path) -> None:
    path = calibration_path(ADDRESS)

    def refused(said: str) -> None:
        with pytest.raises(ConfigurationError, match=said):
            load_calibration(ADDRESS)

    (own_folder / "feelahead").write_text("a file where a folder should be")
    refused("cannot be read: Not a directory")
    (own_folder / "feelahead").unlink()
    path.parent.mkdir(parents=True)
    path.write_bytes(b"\xff\xfe\x00")
    refused("utf-8")
    path.unlink()
    os.mkfifo(path)
    refused(r"is no regular file.*delete the file")
    path.unlink()
    path.mkdir()
    refused("cannot be read")


@pytest.mark.parametrize("address", ["", "aa:bb", "../../etc/passwd", "AA:BB:CC:00:11:22", "aa-bb-cc-00-11-22"])
def test_what_is_no_address_never_becomes_a_path(address: str) -> None:
    with pytest.raises(ValueError, match="address"):
        load_calibration(address)
