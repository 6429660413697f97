"""Initial ramdisk of the virtual machine: busybox, kernel modules, and a script that switches to the host's files."""

import gzip
import lzma
import re
import shlex
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

WANTED: Final = ("virtio_pci", "9pnet_virtio", "9p", "hid_generic", "hid_playstation", "uhid", "uinput", "evdev")
"""Kernel modules that the tests need; `module_order` adds their dependencies"""
RESULT_MARK: Final = "kernel test: exit code "
"""Start of the output line that gives the test program's exit code"""
WRITABLE: Final = "/dev/shm"  # noqa: S108  # the guest's own, in memory
"""The only folder that programs in the virtual machine can write, in its memory"""

_FOLDER, _EXECUTABLE = 0o040755, 0o100755

# The host's root is mounted read-only: the test can only change the guest.
_INIT = """\
#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
for module in {modules}; do
    insmod /modules/$module.ko || echo "insmod $module failed"
done
mount -t 9p -o trans=virtio,version=9p2000.L,ro,cache=loose,msize=262144 host /host || echo "no root over 9p"
mount -t proc proc /host/proc
mount -t sysfs sys /host/sys
mount -t devtmpfs dev /host/dev
mkdir -p /host{writable}
mount -t tmpfs tmpfs /host{writable}
ip link set lo up
chroot /host {command} > /dev/ttyS1 2>&1
echo "{mark}$?" > /dev/ttyS1
sync
poweroff -f
"""


def module_order(folder: Path, wanted: Iterable[str] = WANTED) -> dict[str, Path]:
    """Return the files, by module name, of `wanted` and all their dependencies, each after its own dependencies.

    Modules built into the kernel are left out. FileNotFoundError for a module that is neither built in nor in `folder`.
    """
    files = {_name(path.name): path for path in folder.rglob("*.ko*")}
    built_in = {_name(line.rsplit("/", 1)[-1]) for line in (folder / "modules.builtin").read_text().splitlines()}
    ordered: dict[str, Path] = {}

    def add(name: str) -> None:
        if name in ordered or name in built_in:
            return
        if name not in files:
            raise FileNotFoundError(f"the kernel has no module {name}")
        for needed in _depends(read_module(files[name])):
            add(needed)
        ordered[name] = files[name]

    for name in wanted:
        add(name)
    return ordered


def read_module(path: Path) -> bytes:
    """Return the bytes of a module, decompressed if Debian has compressed it."""
    content = path.read_bytes()
    return lzma.decompress(content) if path.suffix == ".xz" else content


def _name(file: str) -> str:
    return file.partition(".ko")[0].replace("-", "_")


def _depends(module: bytes) -> list[str]:
    """Return the names of the modules that a module lists as its dependencies."""
    found = re.search(rb"(?:^|\0)depends=([^\0]*)\0", module)
    return [name.replace("-", "_") for name in found[1].decode().split(",") if name] if found else []


def make_ramdisk(busybox: Path, modules: Mapping[str, Path], command: list[str]) -> bytes:
    """Return a compressed archive whose /init runs `command` in the host's root and then switches the machine off."""
    script = _INIT.format(modules=" ".join(modules), command=shlex.join(command), mark=RESULT_MARK, writable=WRITABLE)
    entries = [(folder, _FOLDER, b"") for folder in ("bin", "dev", "host", "modules", "proc", "sys")]
    entries.append(("bin/busybox", _EXECUTABLE, busybox.read_bytes()))
    entries += [(f"modules/{name}.ko", _EXECUTABLE, read_module(path)) for name, path in modules.items()]
    entries.append(("init", _EXECUTABLE, script.encode()))
    archive = b"".join(
        _entry(number, *entry) for number, entry in enumerate([*entries, ("TRAILER!!!", 0, b"")], start=1)
    )
    return gzip.compress(archive, 1)


def _entry(number: int, name: str, mode: int, content: bytes) -> bytes:
    """Encode one file in cpio's format "newc" (Linux, initramfs buffer format)."""
    encoded = name.encode() + b"\0"
    # Number, mode, owner, group, links, time, size, four device numbers, length of the name, checksum.
    fields = (number, mode, 0, 0, 1, 0, len(content), 0, 0, 0, 0, len(encoded), 0)
    head = b"070701" + b"".join(b"%08X" % field for field in fields) + encoded
    return head + bytes(-len(head) % 4) + content + bytes(-len(content) % 4)
