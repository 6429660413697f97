import os

import numpy as np
import pytest

from common.errors import ConfigurationError, FeelaheadError
from feelahead.benchmarks.viewing.bench import Turns, bench_viewing
from feelahead.benchmarks.viewing.companion_process import companion_of, processor_s
from feelahead.benchmarks.viewing.viewer import Seen


def turn(began_s: float) -> Seen:
    return Seen(began_s, began_s + 1.0)


def test_each_turn_has_figures_of_its_own_ticks_once_it_has_settled() -> None:
    # 100 us for each tick in the first second, 150 us in the next, of which every tenth is not taken.
    now_s = np.arange(0.0, 2.0, 1e-3)
    now_s = now_s[(now_s < 1.0) | (np.arange(2000) % 10 != 5)]
    took_s = np.where(now_s < 1.0, 100e-6, 150e-6)
    turns = Turns(np.column_stack([now_s, took_s, 0.4 * now_s]))
    seen = [turn(0.0), turn(1.0)]
    assert turns.each(seen, "p50") == pytest.approx([100.0, 150.0])
    assert turns.each(seen, "p99") == pytest.approx([100.0, 150.0])
    assert turns.each(seen, "thread") == pytest.approx([0.4, 0.4])
    assert turns.each(seen, "missed") == pytest.approx([0.0, 80.0], abs=1.5)


def test_a_turn_without_ticks_is_no_measurement() -> None:
    with pytest.raises(FeelaheadError, match="too busy"):
        Turns(np.empty((0, 3))).each([turn(0.0)], "p50")


@pytest.mark.parametrize("arguments", [["--turns", "1"], ["--seconds", "0.1"], ["--seconds", "61"]])
def test_values_out_of_range_are_refused(arguments: list[str]) -> None:
    with pytest.raises(ConfigurationError, match="valid"):
        bench_viewing(arguments)


def test_a_process_without_a_companion_has_none() -> None:
    assert companion_of(os.getpid()) is None
    before_s = processor_s(os.getpid())
    sum(number * number for number in range(500_000))
    assert processor_s(os.getpid()) >= before_s
