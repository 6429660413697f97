"""Run the commands of Docker and of compose, either as `docker compose` or as `docker-compose`."""

import json
import os
import shutil
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from common.errors import ConfigurationError, FeelaheadError

COMPOSE_FILE: Final = Path(__file__).parents[2] / "docker" / "compose.yaml"
_LIMIT_S: Final = 60.0
_READS: Final = 3
_READ_AGAIN_S: Final = 1.0
_LAST_WORDS: Final = 3
"""Number of last lines that an error quotes: compose prints the reason above a summary."""


class EngineError(FeelaheadError):
    """A command of Docker or compose failed; the text is that of the command."""


class Engine:
    """One project of compose: containers, networks and volumes with names of their own."""

    def __init__(self, project: str, environment: Mapping[str, str] | None = None) -> None:
        """environment: variables besides those of this process, such as DOCKER_HOST.

        Raises ConfigurationError if Docker or compose is missing or cannot be used.
        """
        self.project = project
        self._environment = os.environ | dict(environment or {})
        if not COMPOSE_FILE.is_file():
            raise ConfigurationError(f"{COMPOSE_FILE.name} is not there; valid: a checkout of feelahead, with docker/")
        if shutil.which("docker", path=self._environment.get("PATH")) is None:
            raise ConfigurationError("docker is not installed; valid: apt-get install docker.io docker-compose")
        try:
            self.docker("version")
        except EngineError as error:
            raise ConfigurationError(f"docker: {error}; valid: a running engine that you may use") from error
        self._compose = self._find_compose()

    def docker(self, *words: str) -> str:
        """Run `docker WORDS` and return the output; raises EngineError if it fails."""
        return self._run(["docker", *words], self._environment, _LIMIT_S)

    def compose(self, *words: str, settings: Mapping[str, str] | None = None, limit_s: float = _LIMIT_S) -> str:
        """Run `docker compose WORDS` for this project and return the output. settings: variables of compose.yaml."""
        project = ["--project-name", self.project, "--file", str(COMPOSE_FILE)]
        return self._run([*self._compose, *project, *words], self._environment | dict(settings or {}), limit_s)

    def remove(self) -> None:
        """Stop and remove the project's containers, networks and volumes."""
        self.compose("down", "--volumes", "--timeout", "2")

    def container(self, service: str) -> str:
        """Return the id of the container of a service; raises EngineError unless there is exactly one."""
        labels = {"project": self.project, "service": service}
        filters = [
            word for name, value in labels.items() for word in ("--filter", f"label=com.docker.compose.{name}={value}")
        ]
        found = self.docker("ps", "--all", "--quiet", *filters).split()
        if len(found) != 1:
            raise EngineError(f"{service}: {len(found)} containers of this service")
        return found[0]

    def inspect(self, container: str) -> dict[str, Any]:
        """Return what `docker inspect` says about a container."""
        [known] = json.loads(self.docker("inspect", container))
        return dict(known)

    def read_json(self, container: str, path: str) -> dict[str, Any]:
        """Read a JSON file in a container, which need not be running.

        The volumes of a container that has just ended may be missing for a moment, so several attempts are made. If
        all fail, raises EngineError with the container's exit code and the last lines of its log.
        """
        for remaining in reversed(range(_READS)):
            try:
                packed = self.docker("cp", f"{container}:{path}", "-")
                break
            except EngineError as error:
                if remaining == 0:
                    ended = self.inspect(container)["State"]["ExitCode"]
                    log = self.docker("logs", "--tail", str(_LAST_WORDS), container).strip()
                    raise EngineError(f"{error}; exit code {ended}; last logged: {log}") from error
                time.sleep(_READ_AGAIN_S)
        # The output is a tar archive of one file; the JSON reaches from the first brace to the last.
        content: dict[str, Any] = json.loads(packed[packed.index("{") : packed.rindex("}") + 1])
        return content

    def attached(self, container: str) -> list[str]:
        """Return a command that starts a container, shows its output, forwards signals and ends with its exit code."""
        return ["docker", "start", "--attach", container]

    @property
    def environment(self) -> Mapping[str, str]:
        """Environment variables with which the commands run."""
        return self._environment

    def _find_compose(self) -> list[str]:
        for words in (["docker", "compose"], ["docker-compose"]):
            try:
                self._run([*words, "version"], self._environment, _LIMIT_S)
            except EngineError:
                continue
            return words
        raise ConfigurationError("docker has no compose; valid: apt-get install docker-compose")

    def _run(self, words: Sequence[str], environment: Mapping[str, str], limit_s: float) -> str:
        try:
            done = subprocess.run(
                words,
                env=environment,
                capture_output=True,
                text=True,
                timeout=limit_s,
                check=False,
                stdin=subprocess.DEVNULL,
                # Only this process gets Ctrl-C: a command that has begun, such as `down`, must finish.
                start_new_session=True,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise EngineError(f"{' '.join(words[:3])}: {error}") from error
        if done.returncode != 0:
            said = done.stderr.strip().splitlines() or done.stdout.strip().splitlines()
            raise EngineError(" / ".join(said[-_LAST_WORDS:]) or f"{' '.join(words)}: code {done.returncode}")
        return done.stdout
