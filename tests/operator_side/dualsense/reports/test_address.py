import pytest

from operator_side.dualsense.reports.address import checked_address
from operator_side.dualsense.reports.feature_report import build_address


def test_an_address_is_taken_as_it_is() -> None:
    assert checked_address("a4:5e:60:01:02:0f") == "a4:5e:60:01:02:0f"


@pytest.mark.parametrize(
    "address", ["", "aa:bb", "AA:BB:CC:00:11:22", "aa-bb-cc-00-11-22", "aa:bb:cc:00:11:22\n", "aa:bb:cc:00:11:2२"]
)
def test_any_other_form_is_named(address: str) -> None:
    with pytest.raises(ValueError, match=r"address = .*six pairs"):
        checked_address(address)
    with pytest.raises(ValueError, match=r"address = .*six pairs"):
        build_address(address)


@pytest.mark.parametrize("address", [None, 7, b"aa:bb:cc:00:11:22"])
def test_what_is_no_text_is_named(address: object) -> None:
    with pytest.raises(ValueError, match=r"address = .*six pairs"):
        checked_address(address)
