"""Container engine for the tests, and both sides and the router running on it."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

import pytest

from common.errors import ConfigurationError
from feelahead.containers.engine import COMPOSE_FILE, Engine, EngineError
from tests.containers.watch import Compose
from tests.helpers.machines.debian import cache_folder, install, run_or_skip

_PROJECT: Final = "feelahead-test"
_LINK: Final = "delay 20ms 2ms distribution normal rate 100mbit"
_OFFICIAL: Final = "python:3.11-slim-bookworm"
_OWN: Final = "feelahead-base"
_PATIENCE_S: Final = 60.0


@pytest.fixture(scope="session")
def engine() -> Iterator[Engine]:
    """The machine's running container engine; if there is none, in CI as root, a new one until the tests end."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield Engine(_PROJECT)
    except ConfigurationError as missing:
        if os.environ.get("CI") != "true" or os.geteuid() != 0:
            pytest.skip(f"{missing} (run as root with CI=true, the tests install Debian's)")
        install(("docker.io", "iptables"), "dockerd")
        install(("docker-compose",), "docker-compose")
        yield from _own_engine(cache_folder("containers"))


@pytest.fixture(scope="session")
def compose(engine: Engine) -> Iterator[Compose]:
    """Built images of both sides and the router; all containers, networks and volumes are removed at the end."""
    options = dict.fromkeys(("ROBOT_OPTIONS", "OPERATOR_OPTIONS"), "--status json")
    settings = {"LINK": _LINK, "FEELAHEAD_BASE": _base_image(engine), "FEELAHEAD_IMAGES": engine.project, **options}
    one = Compose(engine, settings)
    engine.remove()
    began_s = time.monotonic()
    engine.compose("build", settings=settings, limit_s=1500.0)
    print(f"images built in {time.monotonic() - began_s:.0f} s")
    try:
        yield one
    finally:
        engine.remove()
    assert not one.existing(f"label=com.docker.compose.project={engine.project}")


def _base_image(engine: Engine) -> str:
    """Return the name of the images' base image; it is made of Debian packages if none can be found or pulled."""
    for image, get in (
        (_OFFICIAL, ("image", "inspect")),
        (_OWN, ("image", "inspect")),
        (_OFFICIAL, ("pull", "--quiet")),
    ):
        try:
            engine.docker(*get, image)
        except EngineError:
            continue
        return image
    install(("debootstrap",), "debootstrap")
    run_or_skip([str(COMPOSE_FILE.parent / "make-base"), _OWN], engine.environment)
    return _OWN


def _own_engine(cache: Path) -> Iterator[Engine]:
    """Start a Docker daemon with separate files and socket; end it afterwards, and remove the bridge that it made."""
    had_bridge = Path("/sys/class/net/docker0").exists()
    place = {name: str(cache / name) for name in ("docker.sock", "data", "exec", "pid")}
    words = [
        *("dockerd", "--host", f"unix://{place['docker.sock']}", "--data-root", place["data"]),
        *("--exec-root", place["exec"], "--pidfile", place["pid"]),
    ]
    environment = {"DOCKER_HOST": f"unix://{place['docker.sock']}"}
    with (
        (cache / "log").open("w") as log,
        # Ctrl-C must reach only this process, which needs the engine for removing everything.
        subprocess.Popen(words, stdout=log, stderr=log, start_new_session=True) as daemon,
    ):
        try:
            _wait_for_daemon(daemon, environment, cache / "log")
            yield Engine(_PROJECT, environment)
            # Remove the layers of older versions of the images.
            _tidy("docker", "image", "prune", "--force", "--filter", "until=168h", environment=environment)
        finally:
            daemon.terminate()
            try:
                daemon.wait(timeout=_PATIENCE_S)
            except subprocess.TimeoutExpired:
                daemon.kill()
            if not had_bridge:
                _tidy("ip", "link", "delete", "docker0", environment={})


def _wait_for_daemon(daemon: subprocess.Popen[bytes], environment: Mapping[str, str], log: Path) -> None:
    end_s = time.monotonic() + _PATIENCE_S
    while not _tidy("docker", "version", environment=environment):
        if daemon.poll() is not None or time.monotonic() > end_s:
            said = [line for line in log.read_text(errors="replace").splitlines() if "level=info" not in line]
            pytest.skip(f"dockerd does not start here: {said[-1] if said else 'without a word'}")
        time.sleep(0.2)


def _tidy(*words: str, environment: Mapping[str, str]) -> bool:
    asked = subprocess.run(words, env=os.environ | dict(environment), capture_output=True, check=False)
    return asked.returncode == 0
