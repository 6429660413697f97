"""Faults of the stream of commands, in virtual time: every number is exact, and the same on every run."""

import math
import random
from collections import deque
from collections.abc import Sequence
from itertools import pairwise

from common.protocol.codec import encode
from feelahead.lab.faults.fault import Outcome, fault
from feelahead.lab.faults.session_bench import CRUISE, QUICK, TICK_S, Bench, cruising

T_S = QUICK.safety.gap_s
_AGE_LIMIT_S = QUICK.safety.age_s + QUICK.safety.jitter_s
_RESTING_RAD_S = 0.005


@fault("stream stops")
def stream_stops() -> Outcome:
    """Kill -9, a half-open connection and a pulled cable all look like this from within."""
    bench, operator = cruising()
    accepted_s = bench.now_s - 3 * TICK_S  # the last of the commands, one each four ticks
    bench.silence(T_S + 0.3)
    speeds = dict(bench.watch.speeds_rad_s)
    before, at_limit = (
        speeds[min(speeds, key=lambda when_s: abs(when_s - at_s))] for at_s in (accepted_s, accepted_s + T_S)
    )
    onsets_s = bench.watch.decelerations_s()
    stood = bench.speed_rad_s < _RESTING_RAD_S
    told = bench.watch.told_to_move
    bench.drive(0.3, operator, r2=CRUISE)
    stayed = bench.speed_rad_s < _RESTING_RAD_S and bench.watch.told_to_move == told and bench.state == "disarmed"
    bench.cruise(operator)
    again = bench.speed_rad_s > _RESTING_RAD_S
    return Outcome(
        at_limit > 0.995 * before and _begins_at_limit(onsets_s) and stood and stayed and again,
        f"deceleration at {_milliseconds(onsets_s)}; it stood, and stood until armed again",
    )


@fault("nobody ticks")
def ticks_stop() -> Outcome:
    """The second line of defence: nobody ticks any more, and the arm goes on by itself for a second."""
    bench, _ = cruising()
    start_s = bench.now_s
    for millisecond in range(1, 1001):
        bench.watch.note(bench.arm.state(start_s + millisecond * TICK_S))
    onsets_s = bench.watch.decelerations_s()
    safe = _begins_at_limit(onsets_s) and bench.speed_rad_s < _RESTING_RAD_S
    return Outcome(safe, f"deceleration at {_milliseconds(onsets_s)}; then it stands")


@fault("gap shorter than T")
def short_gap() -> Outcome:
    """Gaps up to T, one after the other."""
    bench, operator = cruising()
    least = math.inf
    for gap_ms in (50, 90, 99):
        before = bench.speed_rad_s
        bench.silence(1e-3 * gap_ms - TICK_S)
        least = min(least, bench.speed_rad_s / before)
        bench.drive(0.03, operator, r2=CRUISE)
    slowed = len(bench.watch.decelerations_s())
    safe = not slowed and bench.state == "armed" and least > 0.98
    return Outcome(safe, f"{slowed} decelerations; least speed {100.0 * least:.1f} %")


@fault("backlog after a pause")
def backlog() -> Outcome:
    """A queue that grows under the stream; then a pause of two seconds, and all that was held back at once."""
    bench, operator = cruising()
    under_way: deque[tuple[float, bytes]] = deque()
    for step in range(1200):
        bench.tick()
        if step % 4 == 0:  # half a millisecond later for each millisecond, up to 600 ms
            under_way.append((bench.now_s + 0.5e-3 * step, operator.command(bench.now_s, r2=CRUISE)))
        while under_way and under_way[0][0] <= bench.now_s:
            bench.robot.receive(operator.peer, under_way.popleft()[1], bench.now_s)
    bench.silence(0.2)
    bench.cruise(operator)
    held = []
    for step in range(2000):
        bench.tick()
        if step % 4 == 0:
            held.append(operator.command(bench.now_s, r2=1.0))
    told = bench.watch.told_to_move
    for payload in held:
        bench.robot.receive(operator.peer, payload, bench.now_s)
    bench.drive(0.1, operator, r2=CRUISE)
    old = sum(age > _AGE_LIMIT_S + 2.0 * TICK_S for age in bench.applied.values())
    safe = old == 0 and bench.state == "disarmed" and bench.watch.told_to_move == told
    return Outcome(safe, f"{old} applied, {bench.robot.session.safety.discarded_by_age} discarded by age")


@fault("robot side stopped and resumed")
def robot_stopped() -> Outcome:
    """The robot side neither ticks nor receives for a while; then all that came meanwhile is there at once."""
    measured, safe = [], True
    # Within the lease and beyond it.
    for pause_s in (0.5, 2.0):
        bench, operator = cruising()
        last = operator.link.stamp(bench.now_s).sequence
        held = []
        for step in range(round(pause_s / TICK_S)):
            bench.ticks += 1
            if step % 4 == 0:
                held.append(operator.command(bench.now_s, r2=1.0))
        told = bench.watch.told_to_move
        for payload in held:
            bench.robot.receive(operator.peer, payload, bench.now_s)
        bench.drive(0.2, operator, r2=CRUISE)
        applied = sum(sequence > last for sequence in bench.applied)
        safe &= applied == 0 and bench.watch.told_to_move == told and bench.state == "disarmed"
        measured.append(f"{applied} of {len(held)} applied after {pause_s:g} s")
    return Outcome(safe, ", ".join(measured))


@fault("replay, duplicate, reorder")
def replay() -> Outcome:
    """Everything that the owner sends comes twice, in any order within a window, and once more from elsewhere."""
    bench, operator = cruising()
    generator = random.Random(1)  # noqa: S311
    recorded: list[bytes] = []
    window: deque[bytes] = deque()
    order: list[int] = []
    for step in range(400):
        bench.tick()
        if step % 4 == 0:
            recorded.append(operator.command(bench.now_s, r2=generator.uniform(0.3, 0.5)))
            window += [recorded[-1]] * 2
        if len(window) > 8:
            place = generator.randrange(len(window))
            bench.robot.receive(operator.peer, window[place], bench.now_s)
            del window[place]
        command = bench.robot.session.safety.permission(bench.now_s).command
        if command is not None and (not order or order[-1] != command.header.sequence):
            order.append(command.header.sequence)
    still_armed = bench.state == "armed"
    back = sum(later < earlier for earlier, later in pairwise(order))
    bench.silence(0.2)
    told = bench.watch.told_to_move
    # The owner is gone; all its messages keep coming over another connection.
    for step in range(1500):
        bench.tick()
        bench.robot.receive(b"elsewhere", recorded[step % len(recorded)], bench.now_s)
    session = bench.robot.session
    gone = session.lease.owner is None and bench.watch.told_to_move == told
    safe = still_armed and back == 0 and len(order) > 20 and gone
    return Outcome(safe, f"{back} of {len(order)} applied twice or late; the replay kept no lease: {gone}")


@fault("steady 500 ms each way")
def steady_delay() -> Outcome:
    """500 ms each way; not a fault at all."""
    speeds = [_mean_speed(delay_s) for delay_s in (0.0, 0.5)]
    ratio = speeds[1] / speeds[0]
    return Outcome(0.98 < ratio < 1.02, f"speed {100.0 * ratio:.1f} % of that without delay, no stop")


@fault("answers no longer arrive")
def old_loop() -> Outcome:
    """The way back breaks off, so that the operator echoes the same stamp for ever."""
    bench, operator = cruising()
    bench.operators.clear()
    start_s = bench.now_s
    bench.drive(2.3, operator, r2=CRUISE)
    stops = list(bench.robot.session.safety.stops)
    safe = bench.state == "disarmed" and len(stops) == 1 and "loop age" in stops[0][1]
    late_s = stops[0][0] - start_s if stops else math.inf
    in_limit = late_s <= QUICK.safety.max_delay_s + 0.01
    return Outcome(safe and in_limit, f"disarmed {late_s:.3f} s after the last answer")


def _mean_speed(delay_s: float) -> float:
    """Return the speed of the fastest joint while R2 is held evenly, over a link with that delay each way."""
    bench = Bench()
    bench.answer_delay_s = delay_s
    operator = bench.operator(2)
    there: deque[tuple[float, bytes]] = deque()
    seen = 0
    for step in range(3000):
        bench.tick()
        if step % 4 == 0 and operator.token:
            seen += 1
            # Released for half a second, armed, then held.
            payload = operator.command(bench.now_s, r2=CRUISE if seen > 145 else 0.0, arm=135 < seen <= 140)
            there.append((bench.now_s + delay_s, payload))
        elif step % 200 == 0 and not operator.token:
            there.append((bench.now_s + delay_s, encode(operator.link.hello(bench.now_s))))
        while there and there[0][0] <= bench.now_s + 1e-9:
            bench.robot.receive(operator.peer, there.popleft()[1], bench.now_s)
    if bench.robot.session.safety.stops or bench.state != "armed":
        return 0.0
    steady = [speed for _, speed in bench.watch.speeds_rad_s if speed > _RESTING_RAD_S]
    return sum(steady[100:400]) / 300


def _begins_at_limit(onsets_s: Sequence[float]) -> bool:
    """One deceleration, not before T, as far as the watched arm can tell, and no later than T + 5 ms."""
    return len(onsets_s) == 1 and T_S - 5e-4 <= onsets_s[0] <= T_S + 0.005


def _milliseconds(values_s: Sequence[float]) -> str:
    return " and ".join(f"{1e3 * one:.1f} ms" for one in values_s) or "no time"
