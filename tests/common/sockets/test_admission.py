from common.sockets.admission import EACH_OTHER_PER_TICK, OTHERS_PER_TICK, Admission


def admitted(admission: Admission, *peers: bytes, operator: bytes | None = b"operator") -> list[bytes]:
    return [peer for peer, _ in admission.admitted([(peer, b"") for peer in peers], operator)]


def test_the_operator_is_always_heard() -> None:
    admission = Admission()
    assert admitted(admission, *[b"operator"] * 100) == [b"operator"] * 100
    assert admission.unread == 0


def test_a_flooding_stranger_takes_nothing_from_the_operator_or_from_other_strangers() -> None:
    admission = Admission()
    seen = admitted(admission, *[b"flood"] * 1000, b"observer", b"operator", *[b"flood"] * 1000, b"operator")
    assert seen == [b"flood"] * EACH_OTHER_PER_TICK + [b"observer", b"operator", b"operator"]
    assert admission.unread == 2000 - EACH_OTHER_PER_TICK


def test_a_crowd_of_strangers_is_bounded_as_a_whole_in_each_tick() -> None:
    admission = Admission()
    crowd = [b"%d" % number for number in range(100)]
    for _ in range(3):
        admission.begin_tick()
        # However often one receives within the tick.
        assert len(admitted(admission, *crowd)) == OTHERS_PER_TICK
        assert admitted(admission, *crowd) == []
    assert admission.unread == 3 * (200 - OTHERS_PER_TICK)


def test_without_an_operator_everybody_is_a_stranger() -> None:
    admission = Admission()
    assert admitted(admission, *[b"operator"] * 100, operator=None) == [b"operator"] * EACH_OTHER_PER_TICK
