"""Messages that a port holds until they are asked for."""

from common.sockets.door.held import EACH, MOST_PEERS, Held
from common.sockets.driver_port import Received


def message(number: int, peer: bytes = b"eye") -> Received:
    return Received(peer, b"%d" % number, 0.01 * number)


def test_nothing_passes_before_it_is_asked_for_and_then_only_the_newest() -> None:
    held = Held()
    assert held.add([message(number) for number in range(10)]) == []
    assert held.ask() == [message(8), message(9)]
    # Nothing is held any more: the next one passes as soon as it arrives, and only once.
    assert held.ask() == []
    assert held.add([]) == []
    assert held.add([message(10)]) == [message(10)]
    assert held.add([message(11)]) == []
    assert held.ask() == [message(11)]


def test_however_many_peers_send_however_much_few_messages_are_held() -> None:
    held = Held()
    for number in range(1000):
        held.add([message(number, b"%d" % (number // 3 % 10))])
    passed = held.ask()
    assert [one.peer for one in passed] == [b"2"] * EACH + [b"3"]
    assert passed[-1] == message(999, b"3")
    for number in range(1000):
        held.add([message(number, b"%d" % (number // 3 % 10))] * 3)
    assert len(held.ask()) == EACH * MOST_PEERS
