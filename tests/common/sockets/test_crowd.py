"""Whom one port hangs up on when too many come."""

from common.sockets.crowd import Crowd

LIMIT, INTRODUCED_S = 3, 2.0


def surplus(crowd: Crowd, now_s: float) -> list[int]:
    return list(crowd.surplus(now_s))


def full(now_s: float = 0.0) -> Crowd:
    crowd = Crowd(LIMIT, INTRODUCED_S)
    for descriptor in range(LIMIT):
        crowd.came(descriptor, now_s)
    assert surplus(crowd, now_s) == []
    return crowd


def test_the_oldest_newcomer_goes_when_another_one_comes() -> None:
    crowd = full()
    crowd.came(10, 0.1)
    crowd.came(11, 0.1)
    assert surplus(crowd, 0.1) == [0, 1]
    assert surplus(crowd, 0.1) == []
    assert crowd.hung_up == 2


def test_who_has_spoken_stays_and_so_does_who_has_been_there_for_long() -> None:
    crowd = full()
    crowd.spoke(1)
    crowd.came(10, 1.9)
    assert surplus(crowd, 1.9) == [0]
    crowd.came(11, 2.1)
    # 2 has been introduced by now, or it would have ended.
    assert surplus(crowd, 2.1) == [10]


def test_when_all_the_others_are_in_the_new_one_goes() -> None:
    crowd = full()
    crowd.came(10, 5.0)
    assert surplus(crowd, 5.0) == [10]


def test_who_went_leaves_room_and_its_number_stands_for_another_one() -> None:
    crowd = full()
    for descriptor in range(LIMIT):
        crowd.spoke(descriptor)
    crowd.went(1)
    crowd.came(1, 1.0)
    assert surplus(crowd, 1.0) == []
    crowd.came(10, 1.1)
    assert surplus(crowd, 1.1) == [1]
    crowd.went(1)
    crowd.went(1)
    crowd.spoke(99)
    assert surplus(crowd, 1.2) == []
