import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from common.rate.budget import SLICE_S, Budget, on_the_wire
from common.rate.controller import LEAST_BIT_S, MOST_BIT_S, START_BIT_S, RateController, Urgency
from common.rate.outgoing_queue import Echo, OutgoingQueue
from common.rate.pieces import Joining

LIMIT_BYTES = 1 << 20

events = st.lists(
    st.tuples(st.floats(0.0, 0.1), st.sampled_from(["haptics", "telemetry", "video", "scene"]), st.integers(1, 40_000)),
    max_size=60,
)


@given(events)
def test_what_is_paced_keeps_to_the_rate_and_arrives_as_it_was(turns: list[tuple[float, str, int]]) -> None:
    budget = Budget(("video", "scene"))
    joining = {"video": Joining(LIMIT_BYTES), "scene": Joining(LIMIT_BYTES)}
    now_s, paced_bytes, largest_bytes, offered = 0.0, 0, 0, set()
    for number, (wait_s, stream, size_bytes) in enumerate(turns):
        now_s += wait_s
        if stream == "haptics":
            budget.spend(stream, size_bytes, now_s)
        elif stream == "telemetry":
            budget.may_send_telemetry(size_bytes, now_s)
        else:
            whole = number.to_bytes(4) * (1 + size_bytes // 4)
            offered.add(whole)
            budget.offer(stream, whole, now_s)
        for leaving in budget.take(now_s):
            size = on_the_wire(len(leaving.payload))
            paced_bytes, largest_bytes = paced_bytes + size, max(largest_bytes, size)
            arrived = joining[leaving.stream].add(leaving.payload) if leaving.is_piece else leaving.payload
            assert arrived is None or arrived in offered
        assert budget.level_bytes <= SLICE_S * budget.controller.rate_bit_s / 8.0
        assert budget.left_bit_s > 0.0
        assert budget.haptic_interval_s == 0.0
        assert all(budget.waiting_s(stream) >= 0.0 for stream in joining)
    # No echo: the rate stays at its start.
    assert paced_bytes <= START_BIT_S / 8.0 * (now_s + SLICE_S) + largest_bytes
    assert all(one.rejected == 0 for one in joining.values())


def test_haptics_come_before_telemetry_and_that_before_pictures() -> None:
    budget = Budget(("video", "scene"))
    budget.offer("scene", b"s" * 3000, 0.0)
    budget.offer("video", b"v" * 3000, 0.0)
    left = [leaving.stream for turn in range(1, 200) for leaving in budget.take(1e-3 * turn)]
    assert left == sorted(left, reverse=True)

    budget.spend("haptics", 5000, 0.2)
    for turn in range(200, 400):
        budget.spend("haptics", 2000, 1e-3 * turn)
        budget.offer("video", b"v", 1e-3 * turn)
        assert budget.take(1e-3 * turn) == []
    assert budget.held_back()["video"]["rate"] == 198
    told = 0
    for turn in range(400, 800, 20):
        budget.spend("haptics", 9000, 1e-3 * turn)
        told += budget.may_send_telemetry(200, 1e-3 * turn)
    # Telemetry is sent five times a second even where there is no room, so that the screen goes on.
    assert told == 2


def test_a_whole_that_has_begun_is_finished_and_one_that_has_not_gives_way() -> None:
    budget, joining = Budget(("video",)), Joining(LIMIT_BYTES)
    wholes = [bytes([number]) * 5000 for number in range(5)]
    budget.offer("video", wholes[0], 0.0)
    assert budget.take(0.0) == []
    arrived = [joining.add(leaving.payload) for leaving in budget.take(0.01)]
    for whole in wholes[1:]:
        budget.offer("video", whole, 0.01)
    arrived += [joining.add(leaving.payload) for turn in range(11, 300) for leaving in budget.take(1e-3 * turn)]

    assert [whole for whole in arrived if whole is not None] == [wholes[0], *wholes[-2:]]
    assert budget.held_back()["video"] == {"rate": 2, "queue": 0}


@given(
    st.lists(
        st.tuples(st.floats(0.0, 0.5), st.floats(-10.0, 10.0), st.integers(0, 100_000), st.booleans()), max_size=200
    )
)
def test_whatever_a_peer_says_the_rate_stays_within_its_bounds(said: list[tuple[float, float, int, bool]]) -> None:
    controller, queue, now_s = RateController(), OutgoingQueue(), 0.0
    for elapsed_s, delay_s, size_bytes, limited in said:
        now_s += elapsed_s
        controller.sent(size_bytes, now_s, Urgency.PACED)
        queue.echoed(now_s - 0.1, now_s + delay_s)
        for echo in queue.take():
            assert 0.0 <= echo.queue_s < 1000.0
            controller.heard(echo, now_s)
        controller.update(now_s, limited=limited)
        assert LEAST_BIT_S <= controller.rate_bit_s <= MOST_BIT_S


def test_each_echo_counts_once_and_another_clock_is_no_queue() -> None:
    queue = OutgoingQueue()
    for sent_s, arrived_s in ((1.0, 51.0), (1.0, 52.0), (0.5, 60.0), (1.1, 51.2), (1.2, 1e308), (1.3, -1e308)):
        queue.echoed(sent_s, arrived_s)

    assert [(echo.sent_s, round(echo.queue_s, 3)) for echo in queue.take()] == [
        (1.0, 0.0),
        (1.1, 0.1),
        (1.2, 0.0),
        (1.3, 0.0),
    ]
    assert queue.take() == []
    assert queue.summary_ms()["p50"] == 0.0


def test_a_silent_peer_is_met_with_care() -> None:
    controller = RateController()
    controller.heard(Echo(0.0, 50.0, 0.0), 0.02)
    controller.update(0.03, limited=True)
    assert not controller.may_send(0.5)
    controller.update(1.5, limited=True)
    assert controller.may_send(1.5)
    assert controller.rate_bit_s <= 0.25 * START_BIT_S


def test_what_gets_through_without_a_queue_is_allowed() -> None:
    controller = RateController()
    for number in range(100):
        controller.sent(5000, 0.01 * number, Urgency.MUST)
        controller.heard(Echo(0.01 * number, 50.0 + 0.01 * number, 0.0), 0.02 + 0.01 * number)
    assert 0.8 * 4e6 <= controller.rate_bit_s <= 4e6


def test_a_process_that_stood_still_halves_the_rate_at_most_once() -> None:
    controller = RateController()
    controller.rate_bit_s = 8e6
    for number in range(20):
        controller.sent(100, 0.01 * number, Urgency.MUST)
        controller.heard(Echo(0.01 * number, 50.0 + 0.01 * number, 0.0), 0.02 + 0.01 * number)
    # All messages sent meanwhile are read at once.
    for number in range(20, 40):
        controller.heard(Echo(0.01 * number, 50.4, 0.4 - 0.01 * number), 0.42)
    assert controller.rate_bit_s >= 4e6


@given(st.integers(0, 2**32))
def test_a_picture_made_only_while_none_waits_never_gives_way(seed: int) -> None:
    chance = np.random.default_rng(seed)
    budget, under_way, stands_until_ms = Budget[str](("video", "scene")), dict[int, int](), 0
    for now_ms in range(2000):
        now_s = 1e-3 * now_ms
        for view in (0, 1):
            if under_way.get(view) == now_ms:
                del under_way[view]
                budget.offer("video", bytes(int(chance.integers(100, 5000))), now_s)
            if view not in under_way and budget.waiting_s("video") <= 0.03:
                under_way[view] = now_ms + int(chance.integers(1, 40))
        if chance.random() < 0.01:
            stands_until_ms = now_ms + 300
        if now_ms >= stands_until_ms:
            budget.take(now_s)
    assert sum(budget.held_back()["video"].values()) == 0
