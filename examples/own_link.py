"""Delays that one has measured, as a link: a CSV file with a row for each message (docs/link.md).

Run: python examples/own_link.py [FILE.csv]
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from feelahead import Episode

generator = np.random.default_rng(3)
delays_ms = 40.0 + generator.gamma(2.0, 8.0, size=5000)  # in place of measured ones
delays_ms[generator.random(5000) < 0.01] = np.nan  # lost messages

with tempfile.TemporaryDirectory() as folder:
    trace = Path(sys.argv[1] if sys.argv[1:] else f"{folder}/trace.csv")
    rows = [f"{number},{'' if np.isnan(ms) else round(1e6 * ms)}" for number, ms in enumerate(delays_ms)]
    trace.write_text("\n".join(["seq,delay_ns", *rows]))

    for link in ("delay 40ms", f"trace {trace}"):
        episode = Episode(scene="wall", link=link, seed=3).arm().step(6.0, r2_n=2.0)
        history = episode.history
        print(
            f"{link.split()[0]}: loop age {1e3 * history.loop_age_s[history.armed].mean():.0f} ms,"
            f" enlargement {1e3 * history.enlargement_m[history.armed].max():.1f} mm,"
            f" least gap {1e3 * history.true_gap_m.min():.1f} mm"
        )
