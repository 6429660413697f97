"""The file on a disk that is full: cut to its last whole chunk, and no page of the library's on the terminal."""

import resource
from pathlib import Path

import numpy as np
import pytest

from common.recording.mcap_file import RecordingFile


@pytest.mark.parametrize("room", [500_001, 511_117, 532_003, 563_333, 594_567, 600_001])
def test_a_full_disk_is_kept_as_an_error_and_nothing_else_is_said(
    room: int, tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    generator = np.random.default_rng(room)
    path = tmp_path / "run.mcap"
    file = RecordingFile(path, 0.0)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        for number in range(100):
            file.write("/robot/inputs", 0.01 * number, generator.bytes(20_000))
            if number % 10 == 9:
                file.flush()
        file.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert file.error is not None
    assert 0 < file.kept_bytes == path.stat().st_size <= room
    assert "".join(capfd.readouterr()) == ""
    # Outside of a test, who logs with nobody set up to hear it speaks on stderr.
    assert caplog.records == []
