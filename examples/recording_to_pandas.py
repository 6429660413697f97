"""Record an episode, and read the file into pandas, as any recording of the demo or of a real robot.

Run: python examples/recording_to_pandas.py [FILE.mcap]
"""

import sys
import tempfile
from pathlib import Path

from common.recording.reading import open_recording
from feelahead import Episode
from feelahead.recordings.tables import read_tables

with tempfile.TemporaryDirectory() as folder:
    path = Path(sys.argv[1] if sys.argv[1:] else f"{folder}/run.mcap")
    with Episode(scene="wall", link="delay 50ms", seed=3).record(path) as episode:
        episode.arm().step(4.0, r2_n=2.0)

    # What crossed the link and what each side did, at 100 Hz: docs/recording/columns.md
    run = read_tables(open_recording(path)).joined().to_pandas()
    print(run[["command.r2", "controller.r2_meets", "stiffness.r2.course_stiffness"]].iloc[::100])

# The same episode with the simulation's truth, which no recording of a real robot has.
truth = episode.history.to_pandas().set_index("time_s")
print(truth[["travel_r2", "strength_r2", "true_gap_m"]].iloc[::125].round(3))
