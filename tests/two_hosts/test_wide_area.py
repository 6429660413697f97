"""Both sides over the kernel's TCP with delay, loss, rate and queue: they fill no queue, and the arm does not stop."""

import pytest

from tests.helpers.machines.quiet import judged
from tests.two_hosts.wide_area.running import run_trial
from tests.two_hosts.wide_area.trial import Trial
from tests.two_hosts.wide_area.tunnels import what_is_missing

_MISSING = what_is_missing()
pytestmark = [
    pytest.mark.two_hosts,
    pytest.mark.processes,
    pytest.mark.skipif(_MISSING is not None, reason=_MISSING or ""),
]

_QUEUEING_MS = 20.0


@pytest.mark.quiet
@pytest.mark.parametrize(
    "trial",
    [
        pytest.param(Trial(loss=1.0, seconds=15.0), id="another continent, with 1 % of loss"),
        pytest.param(Trial(delay=5.0, rate=0.5, queue=1000.0, seconds=12.0), id="0.5 Mbit/s before a large buffer"),
        pytest.param(Trial(delay=5.0, observer="stops", seconds=12.0), id="an observer that no longer reads"),
    ],
)
def test_armed_without_a_stop_and_without_a_queue(trial: Trial) -> None:
    with judged():
        outcome = run_trial(trial)
        print({name: round(value, 2) if isinstance(value, float) else value for name, value in outcome.items()})
        # Ages include a machine's own share; with a rate, the link's own queue is known.
        assert outcome["link_queue_p95_ms" if trial.rate else "queueing_p95_ms"] <= _QUEUEING_MS
        if trial.loss:
            assert outcome["to_operator_p99_ms"] <= trial.delay + _QUEUEING_MS
        assert (outcome["armed"], outcome["stops"]) == (1.0, 0)


def test_hands_that_rest_take_little_of_a_link() -> None:
    outcome = run_trial(Trial(delay=5.0, person="rests", seconds=8.0))
    assert 0.0 < outcome["to_operator_kbit_s"] < 200.0
