"""The router without any network: which interfaces it chooses, and its commands for the kernel."""

import re
from collections.abc import Mapping
from typing import Any

import pytest

from common.emulation.spec import Direction, LinkSpec
from feelahead.containers.cable import Cable, End, find_cable
from feelahead.containers.netem import BeyondNetemError, Counted, count_packets, netem_words
from tests.helpers.repository import ROOT


def words(spec: str) -> Mapping[Direction, str]:
    return netem_words(LinkSpec.parse(spec))


def interface(name: str, number: int, *addresses: str) -> dict[str, Any]:
    held = [address.split("/") for address in addresses]
    return {
        "ifname": name,
        "ifindex": number,
        "mtu": 1500,
        "addr_info": [{"family": "inet", "local": local, "prefixlen": int(length)} for local, length in held],
    }


LO = interface("lo", 1, "127.0.0.1/8")
SIDES = [interface("eth0", 5, "172.20.0.3/16"), interface("eth1", 7, "172.21.0.2/16")]
ROBOT = "172.21.0.7"


def cable() -> Cable:
    found = find_cable([LO, *SIDES], ROBOT)
    assert found is not None
    return found


@pytest.mark.parametrize("order", [1, -1])
def test_the_robots_end_is_the_one_that_reaches_it(order: int) -> None:
    found = find_cable([LO, *SIDES[::order]], ROBOT)
    assert found == Cable(
        End("eth1", 7, "172.21.0.2/16"),
        End("eth0", 5, "172.20.0.3/16"),
        ROBOT,
    )


@pytest.mark.parametrize("sides", [[], SIDES[:1], SIDES[1:], [SIDES[1], interface("eth0", 5)]])
def test_half_a_cable_is_none(sides: list[dict[str, Any]]) -> None:
    """One of the interfaces is missing: its network is being removed, or has no address yet."""
    assert find_cable([LO, *sides], ROBOT) is None


def test_an_interface_that_went_and_came_back_is_another_one() -> None:
    assert find_cable([SIDES[0], interface("eth1", 9, "172.21.0.2/16")], ROBOT) != cable()


def test_what_is_sent_to_a_side_is_delayed_on_the_way_to_it_and_counted_as_such() -> None:
    said = cable().delays({"to_robot": "delay 20ms", "to_operator": "delay 50ms loss 1%"})
    by_interface = {line[line.index("dev") + 1]: " ".join(line) for line in said if "netem" in line}
    assert by_interface["eth1"].endswith("handle 2: netem delay 20ms")
    assert by_interface["eth0"].endswith("handle 3: netem delay 50ms loss 1%")
    queues = [
        {"kind": "noqueue", "handle": "0:", "packets": 9, "drops": 0},
        {"kind": "netem", "handle": "3:", "packets": 990, "drops": 10},
        {"kind": "netem", "handle": "2:", "packets": 500, "drops": 0},
    ]
    assert count_packets(queues) == {"to_robot": Counted(500, 0), "to_operator": Counted(990, 10)}
    assert count_packets(queues[:1]) == {}


def test_the_rules_pass_on_the_two_ports_only() -> None:
    rules = cable().rules()
    assert "policy drop" in rules
    assert rules.count("{ 5555, 5556 }") == 2


@pytest.mark.parametrize(
    ("spec", "to_robot", "to_operator"),
    [
        ("to_robot: delay 20ms; to_operator: delay 50ms loss 1%", "delay 20ms", "delay 50ms loss 1%"),
        ("", "delay 0ms", "delay 0ms"),
        # Nothing here sends video, so no netem is needed for it.
        ("delay 5ms; video: rate 2mbit", "delay 5ms", "delay 5ms"),
    ],
)
def test_each_direction_gets_its_own_words(spec: str, to_robot: str, to_operator: str) -> None:
    assert words(spec) == {"to_robot": to_robot, "to_operator": to_operator}


@pytest.mark.parametrize(
    ("spec", "why"),
    [
        ("delay 10ms 5ms distribution exponential", "distribution"),
        ("delay 10ms outage 1s at 2s", "outage"),
        ("to_operator.telemetry: delay 5ms", "streams"),
        ("to_robot: outage 1s at 2s", "to_robot: outage"),
    ],
)
def test_what_netem_cannot_do_is_left_to_the_sides(spec: str, why: str) -> None:
    with pytest.raises(BeyondNetemError, match=why):
        words(spec)


def test_the_share_that_was_lost_is_of_what_came_since() -> None:
    assert Counted(990, 10).lost_share_since(Counted(0, 0)) == 0.01
    assert Counted(1089, 11).lost_share_since(Counted(990, 10)) == 0.01
    # Nothing came, or netem was set up again meanwhile.
    for now, before in (((990, 10), (990, 10)), ((5, 0), (990, 0)), ((2000, 0), (990, 10))):
        assert Counted(*now).lost_share_since(Counted(*before)) is None


def test_the_locks_of_the_images_are_parts_of_the_lock() -> None:
    whole = pins("requirements.lock")
    for name in ("docker/robot.lock", "docker/operator.lock"):
        assert pins(name)
        assert pins(name) <= whole, name


def pins(name: str) -> set[str]:
    return set(re.findall(r"^[a-z0-9][^ ]*==[^ ]*", (ROOT / name).read_text(), flags=re.MULTILINE))
