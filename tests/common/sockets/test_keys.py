import errno
import os
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from common.errors import ConfigurationError
from common.files.regular_file import read_regular_file
from common.sockets import key_files
from common.sockets import keys as keys_module
from common.sockets.allow_list import AllowList
from common.sockets.authentication import OperatorKeys, RobotKeys
from common.sockets.key_files import checked_key
from common.sockets.keys import KeyFolder, checked_name, read_public_key

KEY, OTHER = "ab" * 32, "cd" * 32


@pytest.fixture
def folder(tmp_path: Path) -> KeyFolder:
    return KeyFolder(tmp_path / "keys")


@pytest.fixture
def allowed(folder: KeyFolder) -> AllowList:
    folder.allow("anna", KEY)
    found = AllowList(folder)
    found.refresh()
    return found


def complaint(call: Callable[[], object]) -> str:
    with pytest.raises(ConfigurationError) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert "valid: " in str(caught.value) or "already" in str(caught.value)
    return str(caught.value)


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_the_secret_is_for_its_owner_alone_whatever_the_umask(folder: KeyFolder) -> None:
    before = os.umask(0)
    try:
        folder.write_pair("robot", KEY, OTHER)
        folder.allow("anna", KEY)
    finally:
        os.umask(before)
    assert mode(folder.secret_path("robot")) == 0o600
    assert mode(folder.path) == mode(folder.allowed_path) == 0o700
    assert folder.secret("robot") == OTHER
    assert read_public_key(str(folder.public_path("robot")), "key") == KEY


@pytest.mark.parametrize("wrong", [0o640, 0o604, 0o660, 0o644])
def test_a_secret_that_others_may_read_is_refused_with_the_command_that_mends_it(folder: KeyFolder, wrong: int) -> None:
    folder.write_pair("robot", KEY, OTHER)
    path = folder.secret_path("robot")
    path.chmod(wrong)
    text = complaint(lambda: folder.secret("robot"))
    assert f"chmod 600 {path}" in text
    assert f"{wrong:04o}" in text
    path.chmod(0o600)
    assert folder.secret("robot") == OTHER


def test_a_key_is_never_replaced_by_accident(folder: KeyFolder) -> None:
    folder.write_pair("robot", KEY, OTHER)
    assert "--replace" in complaint(lambda: folder.write_pair("robot", OTHER, KEY))
    assert folder.secret("robot") == OTHER
    folder.write_pair("robot", OTHER, KEY, replace=True)
    assert folder.secret("robot") == KEY


def test_what_cannot_be_written_is_named_and_no_half_a_key_stays(
    folder: KeyFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.secret_path("robot").mkdir(parents=True)
    with pytest.raises(ConfigurationError, match=r"robot.secret: cannot be written: Is a directory"):
        folder.write_pair("robot", KEY, OTHER, replace=True)
    assert list(folder.path.iterdir()) == [folder.secret_path("robot")]

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "open", full)
    with pytest.raises(ConfigurationError, match=r"operator.secret: cannot be written: No space left"):
        folder.write_pair("operator", KEY, OTHER)


def test_peers_come_and_go(folder: KeyFolder) -> None:
    assert folder.allowed() == {}
    folder.allow("anna", KEY)
    folder.allow("anna", KEY)
    folder.allow("ben", OTHER)
    assert folder.allowed() == {KEY: "anna", OTHER: "ben"}
    folder.revoke("anna")
    assert folder.allowed() == {OTHER: "ben"}
    assert "anna" in complaint(lambda: folder.revoke("anna"))


def test_a_name_stands_for_one_key_and_a_key_for_one_name(folder: KeyFolder) -> None:
    folder.allow("anna", KEY)
    assert "'anna'" in complaint(lambda: folder.allow("anna", OTHER))
    assert "'anna'" in complaint(lambda: folder.allow("ben", KEY))
    assert folder.allowed() == {KEY: "anna"}


@pytest.mark.parametrize("name", ["", "a" * 33, "../robot", "a/b", ".hidden", "-rf", "a b", "ä", "a\n", "a.b"])
def test_names_cannot_leave_the_folder(folder: KeyFolder, name: str) -> None:
    assert repr(name)[:20] in complaint(lambda: checked_name(name))
    with pytest.raises(ConfigurationError):
        folder.revoke(name)


@pytest.mark.parametrize("text", ["", "ab" * 31, "ab" * 33, "zz" * 32, KEY + KEY, "x" * 10_000])
def test_what_is_no_key_is_refused(text: str) -> None:
    said = complaint(lambda: checked_key(text, "--robot-key"))
    assert said.startswith("--robot-key: ")
    assert len(said) < 200


def test_a_key_may_be_given_in_capitals_or_as_a_file(tmp_path: Path) -> None:
    assert read_public_key(KEY.upper(), "key") == KEY
    path = tmp_path / "anna.public"
    path.write_text(f"# somebody's\n\n{KEY}\n")
    assert read_public_key(str(path), "key") == KEY
    for content in ("", f"{KEY}\n{OTHER}\n", "nothing", "é" * 64):
        path.write_text(content)
        assert str(path) in complaint(lambda: read_public_key(str(path), "key"))
    assert "neither a key nor a file" in complaint(lambda: read_public_key("nowhere", "key"))


def test_a_secret_key_is_not_given_away(folder: KeyFolder) -> None:
    folder.write_pair("operator", KEY, OTHER)
    text = complaint(lambda: read_public_key(str(folder.secret_path("operator")), "key"))
    assert "secret" in text
    assert OTHER not in text


def test_the_number_of_peers_is_bounded(folder: KeyFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(keys_module, "PEER_LIMIT", 3)
    for number in range(3):
        folder.allow(f"peer{number}", f"{number:064x}")
    assert "up to 3" in complaint(lambda: folder.allow("more", KEY))


def test_the_next_command_is_named_where_a_key_is_missing(folder: KeyFolder) -> None:
    assert f"feelahead keys make robot --folder {folder.path}" in complaint(lambda: RobotKeys.load(folder.path))
    assert f"feelahead keys make operator --folder {folder.path}" in complaint(
        lambda: OperatorKeys.load(folder.path, KEY)
    )
    folder.write_pair("operator", KEY, OTHER)
    assert "feelahead keys show robot" in complaint(lambda: OperatorKeys.load(folder.path, None))
    assert OperatorKeys.load(folder.path, KEY).robot == KEY


def test_a_running_side_notices_added_and_removed_keys(folder: KeyFolder) -> None:
    allowed = AllowList(folder)
    assert allowed.refresh() == set()
    folder.allow("anna", KEY)
    folder.allow("ben", OTHER)
    assert allowed.refresh() == set()
    assert allowed.names == {KEY: "anna", OTHER: "ben"}
    folder.revoke("anna")
    assert allowed.refresh() == {KEY}
    assert allowed.refresh() == set()
    assert allowed.names == {OTHER: "ben"}


def test_a_peer_whose_file_changed_to_another_key_is_revoked_whatever_the_file_says_of_its_age(
    folder: KeyFolder,
    allowed: AllowList,
) -> None:
    path = folder.peer_path("anna")
    before = path.stat()
    path.write_text(OTHER)  # in place: the same number
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert allowed.refresh() == {KEY}
    assert allowed.names == {OTHER: "anna"}


def make_dangling(path: Path) -> None:
    path.symlink_to("nowhere")


def make_broken(path: Path) -> None:
    path.write_text("half a k")


@pytest.mark.parametrize("spoil", [make_dangling, make_broken, Path.mkdir, os.mkfifo])
def test_a_bad_file_excludes_its_own_key_alone_until_it_is_mended(
    folder: KeyFolder, allowed: AllowList, spoil: Callable[[Path], None]
) -> None:
    folder.allow("ben", OTHER)
    allowed.refresh()
    path = folder.peer_path("ben")
    path.unlink()
    spoil(path)
    assert allowed.refresh() == {OTHER}
    assert allowed.names == {KEY: "anna"}
    [fault] = allowed.faults
    assert "ben.public" in fault
    assert allowed.unreadable is None
    path.rmdir() if path.is_dir() else path.unlink()
    folder.allow("ben", OTHER)
    allowed.refresh()
    assert (allowed.names, allowed.faults) == ({KEY: "anna", OTHER: "ben"}, ())


def test_a_file_that_vanishes_while_it_is_looked_at_throws_nobody_else_out(
    folder: KeyFolder, allowed: AllowList, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.allow("ben", OTHER)
    allowed.refresh()
    folder.allow("carl", "ef" * 32)  # So that the list is read again.

    def read_late(path: Path, largest_bytes: int) -> bytes:
        folder.peer_path("anna").unlink(missing_ok=True)
        return read_regular_file(path, largest_bytes)

    monkeypatch.setattr(key_files, "read_regular_file", read_late)
    assert allowed.refresh() == {KEY}
    assert allowed.names == {OTHER: "ben", "ef" * 32: "carl"}
    allowed.refresh()
    assert (allowed.faults, allowed.unreadable) == ((), None)


@pytest.mark.parametrize("number", [errno.EMFILE, errno.ENFILE, errno.ENOMEM])
@pytest.mark.parametrize("where", ["iterdir", "open"])
def test_allowed_keys_stay_allowed_when_no_file_can_be_opened(
    folder: KeyFolder, allowed: AllowList, monkeypatch: pytest.MonkeyPatch, where: str, number: int
) -> None:
    folder.allow("ben", OTHER)

    def short(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr(*((Path, "iterdir", short) if where == "iterdir" else (os, "open", short)))
        assert allowed.refresh() == set()
    assert allowed.names == {KEY: "anna"}
    assert os.strerror(number) in str(allowed.unreadable)
    allowed.refresh()
    assert allowed.names == {KEY: "anna", OTHER: "ben"}
    assert allowed.unreadable is None


@pytest.mark.parametrize("wrong", [0o770, 0o720, 0o707, 0o702])
def test_a_list_that_others_may_write_lets_nobody_in(folder: KeyFolder, wrong: int) -> None:
    allowed = AllowList(folder)
    folder.allow("anna", KEY)
    folder.allowed_path.chmod(wrong)
    allowed.refresh()
    assert allowed.names == {}
    assert "chmod 700" in str(allowed.unreadable)
    assert "chmod 700" in complaint(folder.allowed)


def test_a_folder_that_vanished_lets_nobody_in(folder: KeyFolder, allowed: AllowList) -> None:
    folder.allowed_path.rename(folder.path / "elsewhere")
    assert allowed.refresh() == {KEY}
    assert allowed.names == {}


def test_a_list_that_cannot_be_read_is_not_taken_for_an_empty_one(
    folder: KeyFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.allow("alice", KEY)
    peers = AllowList(folder)
    peers.refresh()

    def closed(path: Path) -> list[Path]:
        raise PermissionError(13, "Permission denied", str(path))

    # Tests may run as root, whom no mode keeps out.
    monkeypatch.setattr(Path, "iterdir", closed)
    assert peers.refresh() == {KEY}
    assert "Permission denied" in str(peers.unreadable)


def test_a_key_that_is_let_in_twice_is_named_when_one_name_is_revoked(folder: KeyFolder) -> None:
    folder.allow("alice", KEY)
    (folder.allowed_path / "zed.public").write_text(KEY + "\n")
    assert folder.allowed() == {KEY: "alice, zed"}
    assert "still let in as zed" in complaint(lambda: folder.revoke("alice"))
    folder.revoke("zed")
    assert folder.allowed() == {}


def test_a_role_is_kept_with_its_key_and_a_file_without_one_is_an_operators(folder: KeyFolder) -> None:
    folder.allow("anna", KEY, "observer")
    folder.allow("arm", OTHER, "driver")
    allowed = AllowList(folder)
    assert allowed.refresh() == set()
    assert allowed.admits(KEY, ("operator", "observer"))
    assert not allowed.admits(KEY, ("operator", "driver"))
    folder.peer_path("arm").write_text(f"{OTHER}\n")
    assert allowed.refresh() == {OTHER}
    assert allowed.roles == {KEY: "observer", OTHER: "operator"}
    folder.peer_path("arm").write_text(f"{OTHER}\nking\n")
    assert allowed.refresh() == {OTHER}
    [fault] = allowed.faults
    assert "'king'" in fault
    assert "operator, observer, driver, perception" in fault


def test_one_key_under_two_names_has_one_role(folder: KeyFolder) -> None:
    folder.allow("anna", KEY, "observer")
    folder.peer_path("ben").write_text(f"{KEY}\ndriver\n")
    peers = folder.peers()
    assert peers.roles == {KEY: "observer"}
    assert "one role for each key" in peers.faults[0]


@pytest.mark.parametrize("fault", ["a link", "2 names", "mode 0666", "belongs to user"])
def test_a_file_that_others_may_change_lets_nobody_in_and_the_others_stay(
    folder: KeyFolder, allowed: AllowList, tmp_path: Path, fault: str
) -> None:
    folder.allow("ben", OTHER)
    path, elsewhere = folder.peer_path("ben"), tmp_path / "elsewhere"
    if fault == "a link":
        path.rename(elsewhere)
        path.symlink_to(elsewhere)
    elif fault == "2 names":
        os.link(path, elsewhere)
    elif fault == "mode 0666":
        path.chmod(0o666)
    elif os.geteuid() == 0:
        os.chown(path, 12345, 12345)
    else:
        pytest.skip("only root gives a file to another user")
    allowed.refresh()
    assert allowed.names == {KEY: "anna"}
    [said] = allowed.faults
    assert fault in said
    assert "valid: " in said


def test_a_folder_above_that_others_may_write_to_is_named(tmp_path: Path) -> None:
    open_to_all = tmp_path / "shared"
    folder = KeyFolder(open_to_all / "keys")
    folder.allow("anna", KEY)
    open_to_all.chmod(0o777)
    assert f"{open_to_all}: other users may write there (mode 0777)" in complaint(folder.allowed)
    open_to_all.chmod(0o1777)  # As /tmp, where nobody renames what belongs to another user.
    assert folder.allowed() == {KEY: "anna"}
