"""What the kernel's own driver makes of the virtual controller."""

from tests.kernel.kernel_view import seen_device
from tests.kernel.plugged import Plugged
from tests.kernel.waiting import require, wait_until


def binds(plugged: Plugged) -> str:
    """hid-playstation takes it, and its input devices appear."""
    view = wait_until("the kernel shows the controller", lambda: seen_device(plugged.identity))
    inputs = wait_until("three input devices", lambda: found if len(found := view.inputs()) == 3 else None)
    require(view.driver == "playstation", f"the driver is {view.driver}")
    name = plugged.identity.name
    require(set(inputs) == {name, f"{name} Motion Sensors", f"{name} Touchpad"}, f"input devices: {sorted(inputs)}")
    hidraw = view.hidraw()
    require(hidraw is not None and hidraw.exists(), f"hidraw device: {hidraw}")
    require(plugged.offered.counts.features >= 3, f"the driver read {plugged.offered.counts.features} features")
    require(plugged.offered.counts.refused == 0, f"{plugged.offered.counts.refused} reports were refused")
    return f"{view.driver}, {hidraw}"


DRIVER_CHECKS = (binds,)
