"""`feelahead doctor --depth`, over real sockets and with simulated cameras."""

import json
import re
import time
from typing import Any

import msgpack
import numpy as np
import pytest
import zmq

from common.errors import ConfigurationError
from feelahead.main import command
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.python_process import ended, start

MOUNT = {"link": "world", "position_m": [0.5, 0.0, 1.5], "quaternion": [0.0, 1.0, 0.0, 0.0]}
WIDTH, HEIGHT = 160, 120


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["--depth"], "no depth camera is named"),
        (["--depth", "nowhere"], "nowhere"),
        (["--perception", "nothing"], "there is no such perception"),
        (["--perception", "depth", "--arm", "tcp://127.0.0.1:0"], "exclude each other"),
        (["--depth", "tcp://127.0.0.1:0", "--seconds", "0"], "seconds = 0"),
        (["--depth", "tcp://127.0.0.1:0", "--depth-camera.sensor", "eye"], "valid: d435"),
    ],
)
def test_a_look_that_cannot_begin_says_why(flags: list[str], said: str) -> None:
    with pytest.raises(ConfigurationError, match=re.escape(said)):
        command(["doctor", *flags])


@pytest.mark.processes
def test_the_pictures_of_a_process_are_looked_at() -> None:
    look = "-m", "feelahead", "doctor", "--depth", "tcp://127.0.0.1:0", "--seconds", "1", "--json"
    with start(*look) as doctor, zmq.Context() as context, context.socket(zmq.DEALER) as camera:
        try:
            assert doctor.stderr is not None
            line = next(line for line in doctor.stderr if "waiting for depth pictures at" in line)
            camera.setsockopt(zmq.LINGER, 0)
            camera.connect(line.split()[-1])
            sequence, since_s = 0, time.monotonic()
            while doctor.poll() is None and time.monotonic() - since_s < LIMIT_S:
                sequence += 1
                camera.send(msgpack.packb(message(sequence, age_s=5.0 if sequence < 3 else 0.05)))
                time.sleep(0.03)
            found = json.loads(doctor.stdout.read()) if doctor.stdout is not None else {}
        finally:
            doctor.kill()
    said = {finding["name"]: finding["said"] for finding in found["findings"]}
    assert list(said) == [f"above: {what}" for what in ("pictures", "age", "holes", "range", "mount", "rods")]
    assert "160 x 120 pixels" in said["above: pictures"]
    assert said["above: holes"].startswith("25% of the pixels are empty")
    assert "1.40 to 1.40 m are measured" in said["above: range"]
    assert "as its model starts" in said["above: mount"]


@pytest.mark.processes
def test_the_mount_of_a_simulated_camera_is_solved_in_several_poses() -> None:
    cameras = "--depth-camera.eyes", "fixed", "--depth-camera.mount-error-m", "0.02", "--depth-camera.rate-hz", "5"
    look = (
        "-m",
        "feelahead",
        "doctor",
        "--perception",
        "depth",
        *cameras,
        "--solve",
        "fixed",
        "--seconds",
        "10",
        "--json",
    )
    code, told, complaint = ended(*look)
    if "no depth can be rendered here" in complaint:
        pytest.skip(complaint.splitlines()[-1])
    assert told, complaint
    found = json.loads(told)
    solved = found["findings"][-1]
    assert (solved["name"], solved["verdict"]) == ("fixed: solved mount", "ok"), solved
    assert '[depth.mounts."fixed"]' in found["mount"]
    assert not any(finding["name"] == "fixed: mount" for finding in found["findings"])
    assert code in (0, 1)


def message(sequence: int, age_s: float) -> dict[str, Any]:
    """Return a picture of a floor 1.4 m below the camera, a quarter of which is empty."""
    depth, now_s = np.full((HEIGHT, WIDTH), 1400, "<u2"), time.monotonic()
    depth[:, : WIDTH // 4] = 0
    return {
        **{"version": 1, "sequence": sequence, "sent_s": now_s, "taken_s": now_s - age_s, "camera": "above"},
        **{"width": WIDTH, "height": HEIGHT, "depth": depth.tobytes(), "depth_unit_m": 0.001, "mount": MOUNT},
        "intrinsics": {"fx": 130.0, "fy": 130.0, "cx": 80.0, "cy": 60.0},
    }
