"""The benchmark of effects: its arithmetic, its handle, and that a run comes to its end."""

import numpy as np
import pytest

from common.errors import ConfigurationError
from feelahead.benchmarks.effects.effect_latency import (
    EffectLatencySettings,
    StampingBackend,
    Stamps,
    bench_effects,
    first_writes,
    measure,
)
from feelahead.main import command
from operator_side.core import STIFFNESS_EXPIRES_S
from operator_side.dualsense.effects.official import Feedback
from operator_side.dualsense.hid.finding import find_controller
from operator_side.dualsense.reports.output_report import OutputReport, build_output_report
from operator_side.dualsense.reports.transport import Transport


def test_each_change_is_followed_by_the_first_write_before_the_next() -> None:
    changed_s, written_s = np.array([1.0, 2.0, 3.0]), np.array([0.5, 1.25, 1.5, 3.5])
    np.testing.assert_equal(first_writes(changed_s, written_s, 4.0), [0.25, np.nan, 0.5])
    np.testing.assert_equal(first_writes(changed_s, written_s, 3.4), [0.25, np.nan, np.nan])
    np.testing.assert_equal(first_writes(changed_s, np.array([]), 4.0), [np.nan] * 3)


@pytest.mark.parametrize("transport", list(Transport))
def test_what_is_stamped_is_what_the_driver_writes(transport: Transport) -> None:
    backend = StampingBackend(transport)
    controller = find_controller(backend)
    assert transport.value in controller.name
    stiff = OutputReport(r2=Feedback(2, 5))
    controller.device.write(build_output_report(stiff), 0.0)
    stamps: Stamps = backend.stamps
    [(_, report)] = stamps
    assert report == build_output_report(stiff, transport)


@pytest.mark.processes
@pytest.mark.parametrize("transport", ["usb", "bluetooth"])
def test_a_run(transport: str) -> None:
    outcome = measure(EffectLatencySettings(changes=20, transport=transport))
    assert outcome.latencies_s.shape == (20,)
    assert not np.any(outcome.latencies_s <= 0.0)
    assert outcome.writes > 0
    if outcome.writes_at_rest and outcome.longest_pause_s > STIFFNESS_EXPIRES_S / 4:
        pytest.skip(f"not judged: the machine kept one end for {1e3 * outcome.longest_pause_s:.0f} ms")
    assert outcome.writes_at_rest == 0


@pytest.mark.parametrize("flag", ["--changes=0", "--transport=wifi", "--seed=-1"])
def test_bad_flags_are_named(flag: str) -> None:
    with pytest.raises(ConfigurationError, match=flag.split("=", maxsplit=1)[0]):
        bench_effects([flag])


def test_it_is_one_of_the_benchmarks(capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["bench"]) == 0
    assert "effects" in capsys.readouterr().out
