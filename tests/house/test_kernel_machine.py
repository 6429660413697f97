"""What `make test-kernel` makes of its machine: results are passed on, and only what is missing is skipped."""

import gzip
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.repository import ROOT
from tests.kernel.machine import MachineError, run_machine
from tests.kernel.packages import Parts, provide
from tests.kernel.ramdisk import make_ramdisk, module_order
from tests.kernel.skipped import SkippedError


def machine(folder: Path, script: str) -> Parts:
    """A machine that runs `script` instead of a kernel."""
    qemu = folder / "qemu"
    qemu.write_text(f"#!/bin/sh\n{script}\n")
    qemu.chmod(0o755)
    return Parts(qemu, {}, None, folder / "vmlinuz-1", folder, folder / "busybox")


def run(folder: Path, script: str, limit_s: float = 30.0) -> tuple[int, list[str]]:
    lines: list[str] = []
    return run_machine(machine(folder, script), folder / "ramdisk", folder / "console", limit_s, lines.append), lines


@pytest.mark.processes
@pytest.mark.parametrize("code", [0, 1, 139])
def test_the_programs_exit_code_is_the_machines(tmp_path: Path, code: int) -> None:
    said = f"printf 'one\\r\\ntwo\\nkernel test: exit code {code}\\n'"
    assert run(tmp_path, said) == (code, ["one", "two"])


@pytest.mark.processes
def test_a_machine_without_a_result_has_failed(tmp_path: Path) -> None:
    with pytest.raises(MachineError, match="ended with code 7 and without a result"):
        run(tmp_path, "echo half a line; exit 7")


@pytest.mark.processes
def test_a_machine_that_hangs_has_failed(tmp_path: Path) -> None:
    with pytest.raises(MachineError, match=r"no result within 0\.2 s"):
        run(tmp_path, "exec sleep 60", limit_s=0.2)


def test_without_the_programs_of_debian_it_is_skipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SkippedError, match="no apt-get"):
        provide(tmp_path / "cache")


@pytest.mark.processes
def test_packages_that_cannot_be_had_are_skipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for program in ("apt-get", "apt-cache", "dpkg-deb"):
        (tmp_path / program).write_text("#!/bin/sh\necho 'E: Unable to fetch' >&2; exit 100\n")
        (tmp_path / program).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    with pytest.raises(SkippedError, match="apt-get update: Unable to fetch"):
        provide(tmp_path / "cache")


@pytest.mark.processes
def test_the_command_says_why_it_is_skipped_and_ends_well(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.kernel", "--cache", str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        env={"PATH": str(tmp_path), "PYTHONPATH": str(ROOT)},
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("skipped: no apt-get")


# The ramdisk


def module(folder: Path, name: str, *depends: str) -> None:
    content = f"ELF\0license=GPL\0depends={','.join(depends)}\0retpoline=Y\0"
    (folder / f"{name}.ko").write_bytes(content.encode())


def test_modules_come_after_what_they_need(tmp_path: Path) -> None:
    (tmp_path / "modules.builtin").write_text("kernel/drivers/hid/hid.ko\n")
    module(tmp_path, "uhid", "hid")
    module(tmp_path, "hid-playstation", "led-class", "ff-memless", "hid")
    module(tmp_path, "led-class", "ff-memless")
    module(tmp_path, "ff-memless")
    module(tmp_path, "not-wanted")
    assert list(module_order(tmp_path, ["hid_playstation", "uhid"])) == [
        "ff_memless",
        "led_class",
        "hid_playstation",
        "uhid",
    ]
    with pytest.raises(FileNotFoundError, match="no module other"):
        module_order(tmp_path, ["other"])


def test_the_ramdisk_holds_what_is_to_run(tmp_path: Path) -> None:
    (tmp_path / "busybox").write_bytes(b"busybox!")
    module(tmp_path, "uhid")
    made = make_ramdisk(tmp_path / "busybox", {"uhid": tmp_path / "uhid.ko"}, ["run", "it's"])
    files = unpacked(gzip.decompress(made))
    assert files["bin/busybox"] == b"busybox!"
    assert files["modules/uhid.ko"] == (tmp_path / "uhid.ko").read_bytes()
    script = files["init"].decode()
    assert script.startswith("#!/bin/busybox sh\n")
    assert "for module in uhid; do" in script
    assert "chroot /host run 'it'\"'\"'s' >" in script


def unpacked(archive: bytes) -> dict[str, bytes]:
    """Each file's content, from the format's own description: 13 hexadecimal fields, padding to 4 bytes."""
    files: dict[str, bytes] = {}
    position = 0
    while True:
        assert archive[position : position + 6] == b"070701"
        fields = [int(archive[position + 6 + 8 * n : position + 14 + 8 * n], 16) for n in range(13)]
        size, name_length = fields[6], fields[11]
        name = archive[position + 110 : position + 110 + name_length - 1].decode()
        start = position + -(-(110 + name_length) // 4) * 4
        if name == "TRAILER!!!":
            return files
        files[name] = archive[start : start + size]
        position = start + -(-size // 4) * 4
