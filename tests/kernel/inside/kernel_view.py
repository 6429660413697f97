"""The kernel's view of a controller under /sys."""

from pathlib import Path

from operator_side.dualsense.reports.models import SONY_VENDOR_ID
from operator_side.dualsense.uhid.controller import BUS, UhidIdentity


class KernelView:
    """A HID device."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def driver(self) -> str | None:
        """The name of the driver that has bound it."""
        link = self.folder / "driver"
        return link.resolve().name if link.exists() else None

    def inputs(self) -> dict[str, Path]:
        """The device file of each input device, by its name."""
        found = {}
        for folder in sorted(self.folder.glob("input/input*")):
            events = sorted(folder.glob("event*"))
            if events:
                found[(folder / "name").read_text(encoding="utf-8").strip()] = Path("/dev/input") / events[0].name
        return found

    def hidraw(self) -> Path | None:
        """The raw device file."""
        found = sorted(self.folder.glob("hidraw/hidraw*"))
        return Path("/dev") / found[0].name if found else None


def seen_device(identity: UhidIdentity) -> KernelView | None:
    """The HID device with these ids; None when there is none."""
    ids = f"{BUS[identity.transport]:04X}:{SONY_VENDOR_ID:04X}:{identity.model.value:04X}."
    found = sorted(Path("/sys/bus/hid/devices").glob(f"{ids}*"))
    return KernelView(found[0]) if found else None
