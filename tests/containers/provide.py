"""An engine to try the containers on: the one that runs, or, in CI and as root, one of our own while we need it."""

import os
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Final

from common.errors import ConfigurationError
from feelahead.containers.engine import COMPOSE_FILE, Engine, EngineError
from tests.containers.debian import Say, install, run_or_skip
from tests.kernel.skipped import SkippedError

PROJECT: Final = "feelahead-test"
_OFFICIAL: Final = "python:3.11-slim-bookworm"
_OWN: Final = "feelahead-base"
_PACKAGES: Final = ("docker.io", "docker-compose", "iptables")
_PATIENCE_S: Final = 60.0


def default_cache() -> Path:
    """Where images are kept from one run to the next."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "feelahead" / "containers-test"


@contextmanager
def provided_engine(cache: Path, say: Say) -> Iterator[Engine]:
    """The engine that runs here; else, in CI and as root, our own one, which ends with us. Else SkippedError."""
    with ExitStack() as stack:
        try:
            engine = Engine(PROJECT)
        except ConfigurationError as missing:
            if os.environ.get("CI") != "true" or os.geteuid() != 0:
                raise SkippedError(f"{missing} (with CI=true, root gets one of Debian's)") from None
            install(_PACKAGES, "dockerd", say)
            install(("docker-compose",), "docker-compose", say)
            engine = Engine(PROJECT, stack.enter_context(_own_engine(cache, say)))
        yield engine


def base_image(engine: Engine, say: Say) -> Mapping[str, str]:
    """The setting of compose.yaml that names a base image; one is made of Debian's packages where none can be had."""
    for image, get in (
        (_OFFICIAL, ("image", "inspect")),
        (_OWN, ("image", "inspect")),
        (_OFFICIAL, ("pull", "--quiet")),
    ):
        try:
            engine.docker(*get, image)
        except EngineError:
            continue
        return {"FEELAHEAD_BASE": image}
    if os.geteuid() != 0:
        raise SkippedError(f"{_OFFICIAL} cannot be pulled, and only root can make a base image")
    install(("debootstrap",), "debootstrap", say)
    say("no registry of images: making a base image with debootstrap")
    run_or_skip([str(COMPOSE_FILE.parent / "make-base"), _OWN], engine.environment)
    return {"FEELAHEAD_BASE": _OWN}


@contextmanager
def _own_engine(cache: Path, say: Say) -> Iterator[Mapping[str, str]]:
    """A daemon with files and a socket of its own; the bridge that it made goes with it."""
    cache.mkdir(parents=True, exist_ok=True)
    had_bridge = Path("/sys/class/net/docker0").exists()
    place = {name: str(cache / name) for name in ("docker.sock", "data", "exec", "pid")}
    words = [
        *("dockerd", "--host", f"unix://{place['docker.sock']}", "--data-root", place["data"]),
        *("--exec-root", place["exec"], "--pidfile", place["pid"]),
    ]
    environment = {"DOCKER_HOST": f"unix://{place['docker.sock']}"}
    say("starting an engine of our own")
    with (
        (cache / "log").open("w") as log,
        # Ctrl-C reaches this process alone, which needs the engine to remove what it made.
        subprocess.Popen(words, stdout=log, stderr=log, start_new_session=True) as daemon,
    ):
        try:
            _wait_for_daemon(daemon, environment, cache / "log")
            yield environment
            # What older versions of the images were built of.
            _tidy(["docker", "image", "prune", "--force", "--filter", "until=168h"], environment)
        finally:
            daemon.terminate()
            try:
                daemon.wait(timeout=_PATIENCE_S)
            except subprocess.TimeoutExpired:
                daemon.kill()
            if not had_bridge:
                _tidy(["ip", "link", "delete", "docker0"], {})


def _wait_for_daemon(daemon: subprocess.Popen[bytes], environment: Mapping[str, str], log: Path) -> None:
    end_s = time.monotonic() + _PATIENCE_S
    asked = ["docker", "version"]
    while subprocess.run(asked, env=os.environ | environment, capture_output=True, check=False).returncode != 0:
        if daemon.poll() is not None or time.monotonic() > end_s:
            said = [line for line in log.read_text(errors="replace").splitlines() if "level=info" not in line]
            raise SkippedError(f"dockerd does not start here: {said[-1] if said else 'without a word'}")
        time.sleep(0.2)


def _tidy(words: list[str], environment: Mapping[str, str]) -> None:
    """On the way out, where a failure changes nothing about what was found."""
    with suppress(OSError, subprocess.TimeoutExpired):
        subprocess.run(words, env=os.environ | environment, capture_output=True, timeout=_PATIENCE_S, check=False)
