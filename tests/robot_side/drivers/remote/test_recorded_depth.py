"""The example that sends recorded depth, over real sockets."""

from pathlib import Path

import numpy as np
import pytest

from common.sockets.driver_port import DriverPort
from robot_side.drivers.remote.depth import RemoteDepth, TakenDepth
from robot_side.drivers.remote.depth_message import DEPTH_LIMIT_BYTES
from tests.helpers.python_process import start
from tests.helpers.repository import ROOT
from tests.helpers.socket_talk import EPHEMERAL, ROUNDS

pytestmark = pytest.mark.processes


def test_a_recorded_picture_arrives_from_where_its_camera_stood(tmp_path: Path) -> None:
    depth_m = np.full((48, 64), 0.5)
    depth_m[5, 7] = np.nan
    pinhole = {"fx": 50.0, "fy": 51.0, "cx": 32.0, "cy": 24.0}
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    file = tmp_path / "seen.npz"
    np.savez(file, depth_m=depth_m, taken_s=3.0, position_m=[1.0, 2.0, 3.0], rotation=quarter, **pinhole)  # type: ignore[arg-type]
    notes: list[str] = []
    found: TakenDepth | None = None
    with DriverPort(EPHEMERAL, "--depth", DEPTH_LIMIT_BYTES) as port:
        depth = RemoteDepth(port, notes.append)
        script = str(ROOT / "docs/drivers/recorded_depth.py")
        with start(script, str(file), port.endpoint, "old", PYTHONPATH=str(ROOT)) as sender:
            try:
                for _ in range(ROUNDS):
                    if "old" in depth.update(port.wait(0.005)) and (found := depth.take("old")) is not None:
                        break
                    assert sender.poll() is None, sender.communicate()[1]
            finally:
                sender.kill()
    assert found is not None
    assert found.picture.depth_m[5, 7] == 0.0
    assert found.picture.depth_m[0, 0] == pytest.approx(0.5, abs=0.0003)
    assert found.picture.pinhole.fy == 51.0
    assert found.mount is not None
    assert found.mount.position_m == (1.0, 2.0, 3.0)
    assert found.mount.quaternion == pytest.approx((np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))
    assert notes == []
