"""The cable between the two networks, found and described without touching any network."""

import json
import re
from pathlib import Path
from typing import Any

import pytest

from feelahead.containers import guest
from feelahead.containers.cable import Cable, End, delays, find_cable
from tests.helpers.repository import ROOT


def interface(name: str, number: int, *addresses: str) -> dict[str, Any]:
    held = [address.split("/") for address in addresses]
    return {
        "ifname": name,
        "ifindex": number,
        "mtu": 1500,
        "address": f"02:42:00:00:00:{number:02x}",
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
        End("eth1", 7, "02:42:00:00:00:07", "172.21.0.2/16"),
        End("eth0", 5, "02:42:00:00:00:05", "172.20.0.3/16"),
        ROBOT,
    )


@pytest.mark.parametrize("sides", [[], SIDES[:1], SIDES[1:], [SIDES[1], interface("eth0", 5)]])
def test_half_a_cable_is_none(sides: list[dict[str, Any]]) -> None:
    """As while a network is taken away, or before an address is there."""
    assert find_cable([LO, *sides], ROBOT) is None


def test_an_interface_that_went_and_came_back_is_another_one() -> None:
    assert find_cable([SIDES[0], interface("eth1", 9, "172.21.0.2/16")], ROBOT) != cable()


def test_what_is_sent_to_a_side_is_delayed_on_the_way_to_it() -> None:
    said = delays(cable().leaves(), {"to_robot": "delay 20ms", "to_operator": "delay 50ms loss 1%"})
    by_interface = {line[line.index("dev") + 1]: " ".join(line) for line in said if "netem" in line}
    assert by_interface["eth1"].endswith("netem delay 20ms")
    assert by_interface["eth0"].endswith("netem delay 50ms loss 1%")


def test_the_rules_pass_on_the_two_ports_only() -> None:
    rules = cable().rules()
    assert "policy drop" in rules
    assert rules.count("{ 5555, 5556 }") == 2


@pytest.mark.processes
def test_the_address_that_the_guest_has_taken_still_counts(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    ran: list[list[str]] = []
    bare = [interface(shown["ifname"], shown["ifindex"]) for shown in SIDES]

    def run(words: list[str]) -> str:
        ran.append(words)
        return json.dumps([LO, *bare])

    monkeypatch.setattr(guest, "run_system", run)
    monkeypatch.setattr(guest, "_KERNEL", "false")
    one = guest.Guest(tmp_path / "guest")
    one.start(cable(), {"to_robot": "delay 20ms", "to_operator": "delay 0ms"})
    assert find_cable(map(one.with_taken_addresses, [LO, *bare]), ROBOT) == cable()
    init = (tmp_path / "guest/init").read_text()
    assert "ip address add 172.20.0.3/16 dev vec0" in init
    assert "dev vec1 parent 1: handle 2: netem delay 20ms" in init
    ran.clear()
    one.stop()
    assert ["ip", "address", "replace", "172.21.0.2/16", "dev", "eth1"] in ran


def test_the_locks_of_the_images_are_parts_of_the_lock() -> None:
    whole = pins("requirements.lock")
    for name in ("docker/robot.lock", "docker/operator.lock"):
        assert pins(name)
        assert pins(name) <= whole, name


def pins(name: str) -> set[str]:
    return set(re.findall(r"^[a-z0-9][^ ]*==[^ ]*", (ROOT / name).read_text(), flags=re.MULTILINE))
