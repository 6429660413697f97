"""One recorded run of both sides in virtual time, for everything that is done with recordings."""

import pytest

from common.recording.reading import Recording, open_recording
from tests.helpers.recorded_runs import record_loopback

DURATION_S = 6.0


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    record_loopback(path, DURATION_S, link="delay 20ms 5ms", seed=3)
    return open_recording(path)
