"""The cable between the two networks, found and described without touching any network."""

import re
from typing import Any

import pytest

from feelahead.containers.router import Cable, find_cable
from tests.helpers.repository import ROOT


def interface(name: str, *addresses: str) -> dict[str, Any]:
    held = [address.split("/") for address in addresses]
    return {"ifname": name, "addr_info": [{"local": local, "prefixlen": int(length)} for local, length in held]}


LO = interface("lo", "127.0.0.1/8")


@pytest.mark.parametrize("swapped", [False, True])
def test_the_robots_side_is_the_one_that_reaches_it(swapped: bool) -> None:
    sides = [interface("eth0", "172.20.0.3/16"), interface("eth1", "172.21.0.2/16")]
    cable = find_cable([LO, *(reversed(sides) if swapped else sides)], "172.21.0.7")
    assert cable == Cable("eth1", "eth0", "172.21.0.7")


@pytest.mark.parametrize(
    "sides",
    [
        [],
        [interface("eth0", "172.20.0.3/16")],
        [interface("eth1", "172.21.0.2/16")],
        [interface("eth1", "172.21.0.2/16"), interface("eth0")],
    ],
)
def test_half_a_cable_is_none(sides: list[dict[str, Any]]) -> None:
    """As while a network is taken away, or before an address is there."""
    assert find_cable([LO, *sides], "172.21.0.7") is None


def test_what_is_sent_to_a_side_is_delayed_on_the_way_to_it() -> None:
    delays = Cable("eth1", "eth0", "172.21.0.7").delays({"to_robot": "delay 20ms", "to_operator": "delay 50ms loss 1%"})
    assert [line[line.index("dev") + 1] for line in delays] == ["eth1", "eth0"]
    assert delays[1][-4:] == ["delay", "50ms", "loss", "1%"]


def test_the_rules_pass_on_the_two_ports_only() -> None:
    rules = Cable("eth1", "eth0", "172.21.0.7").rules()
    assert "policy drop" in rules
    assert rules.count("{ 5555, 5556 }") == 2


def test_the_locks_of_the_images_are_parts_of_the_lock() -> None:
    whole = pins("requirements.lock")
    for name in ("docker/robot.lock", "docker/operator.lock"):
        assert pins(name)
        assert pins(name) <= whole, name


def pins(name: str) -> set[str]:
    return set(re.findall(r"^[a-z0-9][^ ]*==[^ ]*", (ROOT / name).read_text(), flags=re.MULTILINE))
