import threading

import pytest

from common.errors import DeviceError, NoDeviceError
from operator_side.controller.feel import RELEASED
from operator_side.controller.port import OpenController
from operator_side.controller.search import BackgroundSearch, Find
from operator_side.dualsense.hid.finding import LOOKS_FOR_THE_SAME, Finder, Sighting, find_controller, sightings
from operator_side.dualsense.hid.udev import RULES
from operator_side.dualsense.reports.output_report import build_output_report
from tests.helpers.fake_hid import ADDRESS, BLUETOOTH, SIMPLE_REPORT, USB, FakeBackend, FakeHandle
from tests.helpers.machines.waiting import LIMIT_S

A, B = b"/dev/hidraw3", b"/dev/hidraw4"
OTHER = "11:22:33:44:55:66"


@pytest.mark.parametrize(("product_id", "model"), [(0x0CE6, "DualSense"), (0x0DF2, "DualSense Edge")])
@pytest.mark.parametrize("transport", [USB, BLUETOOTH])
def test_either_model_is_found_on_either_transport(product_id: int, model: str, transport: object) -> None:
    handle = FakeHandle(USB if transport is USB else BLUETOOTH)
    found = find_controller(FakeBackend({product_id: {A: handle}}))
    assert found.name == f"{model} on {handle.transport.value} ({ADDRESS})"
    assert (found.address, found.path) == (ADDRESS, A)
    assert found.release == build_output_report(RELEASED, handle.transport)
    assert handle.written == []


def test_there_is_none() -> None:
    with pytest.raises(NoDeviceError, match=r"no DualSense .*054C:0CE6.*0DF2.*USB cable.*Bluetooth.*--device"):
        find_controller(FakeBackend({}))


@pytest.mark.parametrize("paths", [(A, B), (B, A)])
def test_one_controller_on_both_is_taken_on_usb(paths: tuple[bytes, bytes]) -> None:
    wireless, wired = FakeHandle(BLUETOOTH), FakeHandle(USB)
    found = find_controller(FakeBackend({0x0CE6: dict(zip(paths, (wireless, wired), strict=True))}))
    assert found.name.startswith("DualSense on USB")
    assert (wireless.closed, wired.closed) == (wireless.times_opened, 0)
    assert wireless.written == []


def test_the_one_from_before_comes_first_even_on_bluetooth() -> None:
    same, other = FakeHandle(BLUETOOTH), FakeHandle(USB, OTHER)
    found = find_controller(FakeBackend({0x0CE6: {A: other, B: same}}), ADDRESS)
    assert found.address == ADDRESS
    assert find_controller(FakeBackend({0x0CE6: {A: other}}), ADDRESS).address == OTHER


def test_another_is_taken_only_after_several_looks_for_the_one_from_before() -> None:
    same, other = FakeHandle(), FakeHandle(USB, OTHER)
    backend = FakeBackend({0x0CE6: {B: other}})
    look = Finder(backend)
    for _ in range(2):  # The one found then is looked for as often again.
        for _ in range(LOOKS_FOR_THE_SAME):
            with pytest.raises(NoDeviceError, match=f"{ADDRESS} is not connected, only: {OTHER}"):
                look(ADDRESS)
            assert other.closed == other.times_opened
        found = look(ADDRESS)
        assert found.address == OTHER
        found.device.close()
    with pytest.raises(NoDeviceError):
        look(ADDRESS)
    backend.found[0x0CE6][A] = same
    assert look(ADDRESS).address == ADDRESS
    assert other.closed == other.times_opened


def test_the_one_that_was_asked_for_is_taken_alone_and_the_others_are_named() -> None:
    wanted, other, edge = FakeHandle(), FakeHandle(USB, OTHER), FakeHandle(BLUETOOTH, "22:22:33:44:55:66")
    backend = FakeBackend({0x0CE6: {B: other}, 0x0DF2: {b"/dev/hidraw5": edge}})
    look = Finder(backend, ADDRESS)
    for _ in range(2 * LOOKS_FOR_THE_SAME):
        with pytest.raises(NoDeviceError, match=f"{ADDRESS} is not connected, only: {OTHER}, 22:22:33:44:55:66$"):
            look(None)
    backend.found[0x0CE6][A] = wanted
    assert look(OTHER).address == ADDRESS
    assert (other.closed, edge.closed) == (other.times_opened, edge.times_opened)


def test_no_other_is_taken_while_one_refuses_that_may_be_the_one_from_before() -> None:
    same, other = FakeHandle(opens=False, reason="Permission denied"), FakeHandle(USB, OTHER)
    look = Finder(FakeBackend({0x0CE6: {A: same, B: other}}))
    for _ in range(2 * LOOKS_FOR_THE_SAME):
        with pytest.raises(DeviceError, match="no permission to open the controller at /dev/hidraw3"):
            look(ADDRESS)
        assert other.closed == other.times_opened
    same.opens = True
    assert look(ADDRESS).address == ADDRESS


def test_one_that_cannot_be_opened_does_not_hide_another() -> None:
    backend = FakeBackend({0x0CE6: {A: FakeHandle(opens=False, reason="Permission denied"), B: FakeHandle()}})
    assert find_controller(backend).path == B
    del backend.found[0x0CE6][B]
    with pytest.raises(DeviceError, match="no permission to open the controller at /dev/hidraw3"):
        find_controller(backend)


def test_a_dongle_whose_controller_is_off_is_none() -> None:
    dongle, other = FakeHandle(repeats=True), FakeHandle(USB, OTHER)
    backend = FakeBackend({0x0CE6: {A: dongle}})
    look = Finder(backend)
    with pytest.raises(NoDeviceError, match=r"hidraw3 repeats one report, .* off or out of reach: press its PS button"):
        look(None)
    backend.found[0x0CE6][B] = other
    for _ in range(LOOKS_FOR_THE_SAME - 1):
        with pytest.raises(NoDeviceError, match=f"{ADDRESS} is not connected, only: {OTHER}"):
            look(ADDRESS)
    assert look(ADDRESS).path == B
    assert dongle.closed == dongle.times_opened
    dongle.repeats = False
    assert look(ADDRESS).path == A
    silent = FakeHandle(BLUETOOTH, waiting=[SIMPLE_REPORT] * 9)  # Told from nothing, so taken.
    assert find_controller(FakeBackend({0x0CE6: {A: silent}})).path == A


def test_a_place_that_is_listed_for_each_of_its_uses_is_one() -> None:
    class Repeating(FakeBackend):
        def enumerate(self, vendor_id: int, product_id: int) -> list[dict[str, object]]:
            return super().enumerate(vendor_id, product_id) * 3

    assert sightings(Repeating({0x0CE6: {A: FakeHandle()}})) == [Sighting(A, "DualSense")]


def test_the_rule_names_every_model_on_usb_and_bluetooth() -> None:
    grant = 'MODE="0660", TAG+="uaccess"'
    for product in ("0ce6", "0df2"):
        assert f'KERNEL=="hidraw*", ATTRS{{idVendor}}=="054c", ATTRS{{idProduct}}=="{product}", {grant}' in RULES
        assert f'KERNEL=="hidraw*", KERNELS=="*054C:{product.upper()}*", {grant}' in RULES
    assert len(RULES) == 4


class Looks:
    """Function `find` for a search, which waits until the test releases it."""

    def __init__(self, result: OpenController | Exception) -> None:
        self.result = result
        self.asked: list[str | None] = []
        self.go_on = threading.Event()
        self.done = threading.Event()

    def find(self, preferred: str | None) -> OpenController:
        self.asked.append(preferred)
        assert self.go_on.wait(LIMIT_S)
        try:
            if isinstance(self.result, OpenController):
                return self.result
            raise self.result
        finally:
            self.done.set()


def finished(search: BackgroundSearch, looks: Looks) -> OpenController | DeviceError | None:
    looks.go_on.set()
    for thread in threading.enumerate():
        if thread.name == "controller search":
            thread.join(LIMIT_S)
    return search.take()


def usable() -> tuple[FakeHandle, Find]:
    handle = FakeHandle()
    return handle, lambda preferred: find_controller(FakeBackend({0x0CE6: {A: handle}}), preferred)


def test_a_look_waits_for_nobody_and_is_one_at_a_time() -> None:
    looks = Looks(NoDeviceError("none"))
    search = BackgroundSearch(looks.find)
    assert search.take() is None
    search.begin("aa")
    search.begin("bb")
    assert search.take() is None
    assert isinstance(finished(search, looks), NoDeviceError)
    assert looks.asked == ["aa"]
    assert search.take() is None


def test_what_else_goes_wrong_is_not_lost() -> None:
    looks = Looks(RuntimeError("in the thread"))
    search = BackgroundSearch(looks.find)
    search.begin(None)
    with pytest.raises(RuntimeError, match="in the thread"):
        finished(search, looks)


def test_what_is_found_too_late_is_let_go() -> None:
    handle, find = usable()
    looks = Looks(find(None))
    search = BackgroundSearch(looks.find)
    search.begin(None)
    search.close()
    finished(search, looks)
    assert handle.closed == handle.times_opened > 0
    search.begin(None)
    assert looks.asked == [None]


def test_what_was_found_and_not_taken_is_let_go() -> None:
    handle, find = usable()
    search = BackgroundSearch(find)
    search.begin(None)
    search.close()
    assert handle.closed == handle.times_opened > 0
    assert handle.written == []
