"""Docker and its compose, driven by their commands: either generation of compose, whichever is installed."""

import json
import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from common.errors import ConfigurationError, FeelaheadError

COMPOSE_FILE: Final = Path(__file__).parents[2] / "docker" / "compose.yaml"
_LIMIT_S: Final = 60.0
_LAST_WORDS: Final = 3
"""Lines: compose ends with a summary, below the reason."""


class EngineError(FeelaheadError):
    """The engine could not do it; the text is what it said."""


class Engine:
    """One project of compose: containers, networks and volumes under a name of their own."""

    def __init__(self, project: str, environment: Mapping[str, str] | None = None) -> None:
        """`environment`: on top of this process's, as DOCKER_HOST; ConfigurationError where there is no engine."""
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
        """Run `docker WORDS` and return its output; EngineError when it fails."""
        return self._run(["docker", *words], self._environment, _LIMIT_S)

    def compose(self, *words: str, settings: Mapping[str, str] | None = None, limit_s: float = _LIMIT_S) -> str:
        """Run `docker compose WORDS` for this project; `settings`: the variables of compose.yaml."""
        project = ["--project-name", self.project, "--file", str(COMPOSE_FILE)]
        return self._run([*self._compose, *project, *words], self._environment | dict(settings or {}), limit_s)

    def remove(self) -> None:
        """End and remove whatever the project has: containers, networks and volumes."""
        self.compose("down", "--volumes", "--timeout", "2")

    def container(self, service: str) -> str:
        """The container of a service; EngineError where it has none."""
        labels = {"project": self.project, "service": service}
        filters = [
            word for name, value in labels.items() for word in ("--filter", f"label=com.docker.compose.{name}={value}")
        ]
        found = self.docker("ps", "--all", "--quiet", *filters).split()
        if len(found) != 1:
            raise EngineError(f"{service}: {len(found)} containers of this service")
        return found[0]

    def inspect(self, container: str) -> dict[str, Any]:
        """Return `docker inspect` of a container."""
        [known] = json.loads(self.docker("inspect", container))
        return dict(known)

    def read_json(self, container: str, path: str) -> dict[str, Any]:
        """A file of JSON out of a container, which need not run."""
        packed = self.docker("cp", f"{container}:{path}", "-")
        # A tar of one file, whose text goes from the first brace to the last.
        content: dict[str, Any] = json.loads(packed[packed.index("{") : packed.rindex("}") + 1])
        return content

    def attached(self, container: str) -> list[str]:
        """The command that starts a container, shows what it prints, hands signals on and ends with its exit code."""
        return ["docker", "start", "--attach", container]

    @property
    def environment(self) -> Mapping[str, str]:
        """The environment of the engine's commands."""
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
                # Ctrl-C is ours to answer: what was begun, such as removing it all, is to be finished.
                start_new_session=True,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise EngineError(f"{' '.join(words[:3])}: {error}") from error
        if done.returncode != 0:
            said = done.stderr.strip().splitlines() or done.stdout.strip().splitlines()
            raise EngineError(" / ".join(said[-_LAST_WORDS:]) or f"{' '.join(words)}: code {done.returncode}")
        return done.stdout
