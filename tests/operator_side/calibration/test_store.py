"""Calibrations on disk: by the controller's address, whole or not at all, and refused when broken."""

import os
import socket
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import ConfigurationError
from operator_side.calibration.store import (
    calibration_path,
    load_calibration,
    place_to_write,
    read_calibration,
    write_calibration,
)
from operator_side.hands.travel_calibration import StickRest, TravelCalibration, TriggerTravel

REPEATABLE = settings(derandomize=True, deadline=None)
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
@REPEATABLE
def test_every_calibration_is_read_as_it_was_written(calibration: TravelCalibration) -> None:
    path = calibration_path(ADDRESS)
    write_calibration(path, ADDRESS, calibration)
    assert read_calibration(path) == (ADDRESS, calibration)


def test_a_write_that_fails_leaves_what_was_there(monkeypatch: pytest.MonkeyPatch) -> None:
    path = calibration_path(ADDRESS)
    write_calibration(path, ADDRESS, MEASURED)

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_calibration(path, ADDRESS, TravelCalibration())
    assert load_calibration(ADDRESS) == MEASURED
    assert [file.name for file in path.parent.iterdir()] == [path.name]


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("version = 1", "version = 2", "version = 2"),
        ("version = 1", "version = true", "version = True"),
        ("version = 1\n", "", "version is missing"),
        ("dead_zone = 0.06", "dead_zone = 0.95", "l2: dead_zone = 0.95"),
        ("dead_zone = 0.06", "dead_zone = nan", "l2.dead_zone = nan"),
        ("dead_zone = 0.06", "dead_zone = true", "l2.dead_zone = True"),
        ("dead_zone = 0.06", 'dead_zone = "0.06"', "l2.dead_zone = '0.06'"),
        ("dead_zone = 0.06", "", "l2.dead_zone is missing"),
        ("saturation = 0.91", "saturation = 0.91\nsaturated = 1", "l2.saturated is unknown"),
        ("[l2]", "[l3]", "l2 is missing"),
        ("x = 0.02", "x = 0.5", "left_stick: x = 0.5"),
        ("aa:bb:cc:00:11:22", "AA:BB", "address = 'AA:BB'"),
        ("aa:bb:cc:00:11:22", "aa:bb:cc:00:11:23", "is of the controller aa:bb:cc:00:11:23"),
        ("[l2]", "[l2", "Expected"),
        ("#", "#" * 20_000, "more than 10000 bytes"),
        ("dead_zone = 0.06", f"dead_zone = 1{400 * '0'}", "more than 64 bits"),
        ("dead_zone = 0.06", f"dead_zone = 1{5000 * '0'}", "more than 64 bits"),
        ("version = 1", f"version = 0x{8000 * 'f'}", "more than 64 bits"),
        ("version = 1", f"version = {4500 * '['}", "nested too deeply"),
        ("version = 1", f"version{4500 * '.a'} = 1", "nested too deeply"),
        ("version = 1", f"version = '{9000 * 'a'}'", "version = 'aaa"),
        (ADDRESS, 9000 * "a", "address = 'aaa"),
    ],
)
def test_a_broken_file_is_named_in_one_line_with_what_mends_it(old: str, new: str, named: str) -> None:
    path = calibration_path(ADDRESS)
    write_calibration(path, ADDRESS, MEASURED)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ConfigurationError) as caught:
        load_calibration(ADDRESS)
    said = str(caught.value)
    assert named in said
    assert str(path) in said
    assert "feelahead calibrate" in said
    assert "\n" not in said
    assert "sys." not in said
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


def test_a_link_stays_and_what_it_leads_to_is_written(tmp_path: Path) -> None:
    target, near, far = tmp_path / "target.toml", tmp_path / "near.toml", tmp_path / "far" / "far.toml"
    target.write_text("before")
    near.symlink_to("target.toml")
    far.parent.mkdir()
    far.symlink_to(near)
    write_calibration(far, ADDRESS, MEASURED)
    assert far.is_symlink()
    assert near.is_symlink()
    assert not target.is_symlink()
    assert read_calibration(target) == (ADDRESS, MEASURED)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["far", "near.toml", "target.toml"]


def in_the_way(kind: str, path: Path) -> None:
    """Put something where a file should be written."""
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as end:
            end.bind(os.path.relpath(path))
    elif kind == "folder":
        path.mkdir()
    elif kind == "link to a device":
        path.symlink_to("/dev/null")
    elif kind == "link to nothing":
        path.symlink_to(path.parent / "gone")
    else:
        path.symlink_to(path.name)


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("pipe", "is no regular file"),
        ("socket", "is no regular file"),
        ("folder", "is a folder"),
        ("link to a device", "is no regular file"),
        ("link to nothing", "which is missing"),
        ("link to itself", "cannot be written"),
    ],
)
def test_what_stands_in_the_way_stays_as_it_is(
    kind: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "mine.toml"
    in_the_way(kind, path)
    before = path.lstat()
    for write in (lambda: write_calibration(path, ADDRESS, MEASURED), lambda: place_to_write(path)):
        with pytest.raises(ConfigurationError, match=said) as caught:
            write()
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)
    assert (path.lstat().st_ino, path.lstat().st_mode) == (before.st_ino, before.st_mode)
    assert list(tmp_path.iterdir()) == [path]


def test_a_device_is_never_replaced() -> None:
    with pytest.raises(ConfigurationError, match="/dev/null: is no regular file"):
        place_to_write(Path("/dev/null"))


def test_only_our_own_folders_are_made(tmp_path: Path, own_folder: Path) -> None:
    with pytest.raises(ConfigurationError, match="there is no folder"):
        write_calibration(tmp_path / "new" / "mine.toml", ADDRESS, MEASURED)
    assert list(own_folder.iterdir()) == []
    assert place_to_write(calibration_path(ADDRESS)) == calibration_path(ADDRESS)
    assert list(own_folder.iterdir()) == []


@pytest.mark.parametrize("address", ["", "aa:bb", "../../etc/passwd", "AA:BB:CC:00:11:22", "aa-bb-cc-00-11-22"])
def test_what_is_no_address_never_becomes_a_path(address: str) -> None:
    with pytest.raises(ValueError, match="address"):
        load_calibration(address)
