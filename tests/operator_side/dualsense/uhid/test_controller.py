"""The controller that the kernel is offered: what it answers, sends and takes."""

import pytest

from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.reports.report_descriptors import BLUETOOTH_DESCRIPTOR, USB_DESCRIPTOR
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.uhid.controller import UhidController, UhidCounts, identity
from operator_side.dualsense.uhid.protocol import create, destroy, get_report_reply, input_report, set_report_reply
from tests.helpers.fake_kernel import (
    CLOSE,
    OPEN,
    OUT,
    START,
    STOP,
    PlainController,
    get_report,
    output,
    said,
    set_report,
)


@pytest.fixture
def plain() -> PlainController:
    return PlainController()


@pytest.fixture
def offered(plain: PlainController) -> UhidController:
    return UhidController(plain, identity())


def test_it_appears_as_what_it_is_and_disappears() -> None:
    told = identity(model=Model.EDGE)
    offered = UhidController(PlainController(), told)
    assert offered.plug_in() == create(told)
    assert offered.unplug() == destroy()


@pytest.mark.parametrize(
    ("transport", "model", "ids", "name"),
    [
        (
            Transport.USB,
            Model.DUALSENSE,
            (3, 0x054C, 0x0CE6),
            "Sony Interactive Entertainment DualSense Wireless Controller",
        ),
        (
            Transport.USB,
            Model.EDGE,
            (3, 0x054C, 0x0DF2),
            "Sony Interactive Entertainment DualSense Edge Wireless Controller",
        ),
        (Transport.BLUETOOTH, Model.DUALSENSE, (5, 0x054C, 0x0CE6), "DualSense Wireless Controller"),
        (Transport.BLUETOOTH, Model.EDGE, (5, 0x054C, 0x0DF2), "DualSense Edge Wireless Controller"),
    ],
)
def test_identities(transport: Transport, model: Model, ids: tuple[int, int, int], name: str) -> None:
    told = identity(transport, model, unique_id="aa:bb")
    assert (told.bus, told.vendor_id, told.product_id) == ids
    assert (told.name, told.unique_id) == (name, "aa:bb")
    assert told.descriptor == (BLUETOOTH_DESCRIPTOR if transport is Transport.BLUETOOTH else USB_DESCRIPTOR)


def test_features_are_answered_as_the_controller_answers(offered: UhidController) -> None:
    assert offered.handle(get_report(42, 5), 0.0) == get_report_reply(42, b"\x05\x01\x02")
    assert offered.handle(get_report(43, 6), 0.0) == get_report_reply(43, None)
    assert offered.handle(get_report(44, 5, OUT), 0.0) == get_report_reply(44, None)
    assert offered.counts == UhidCounts(features=1, refused=2)


def test_output_reports_reach_the_controller(offered: UhidController, plain: PlainController) -> None:
    assert offered.handle(output(b"\x02\x07"), 0.0) is None
    assert offered.handle(output(b"\x03\x07"), 0.0) is None
    assert plain.written == [b"\x02\x07"]
    assert offered.counts == UhidCounts(outputs=1, refused=1)


def test_output_reports_that_want_an_answer_get_one(offered: UhidController, plain: PlainController) -> None:
    assert offered.handle(set_report(9, b"\x02\x07"), 0.0) == set_report_reply(9, accepted=True)
    assert offered.handle(set_report(10, b"\x03\x07"), 0.0) == set_report_reply(10, accepted=False)
    assert offered.handle(set_report(11, b"\x02\x08", kind=0), 0.0) == set_report_reply(11, accepted=False)
    assert plain.written == [b"\x02\x07"]
    assert offered.counts == UhidCounts(outputs=1, refused=2)


def test_input_reports_go_out_while_a_driver_has_it(offered: UhidController) -> None:
    offered.plug_in()
    assert offered.next_input(0.0) is None
    offered.handle(said(START), 0.0)
    # What was made before is lost, as on a cable that nobody polls.
    assert offered.next_input(0.0) == input_report(b"\x01\x02")
    offered.handle(said(STOP), 0.0)
    assert offered.next_input(0.0) is None
    assert offered.counts.inputs == 1


def test_whether_somebody_reads_it(offered: UhidController) -> None:
    offered.handle(said(START), 0.0)
    assert (offered.driven, offered.opened) == (True, False)
    offered.handle(said(OPEN), 0.0)
    assert (offered.driven, offered.opened) == (True, True)
    offered.handle(said(CLOSE), 0.0)
    assert (offered.driven, offered.opened) == (True, False)
    offered.handle(said(OPEN), 0.0)
    offered.unplug()
    assert (offered.driven, offered.opened) == (False, False)


def test_what_a_newer_kernel_says_is_passed_over(offered: UhidController) -> None:
    assert offered.handle(said(99), 0.0) is None
    assert offered.counts == UhidCounts()
