"""Control of an emulated wide area: start it, run programs on its two hosts, and get the forwarder's counts."""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, Self

import msgspec

from common.errors import FeelaheadError
from tests.helpers.repository import ROOT
from tests.two_hosts.wide_area.forwarder import Order
from tests.two_hosts.wide_area.wire_direction import Direction, DirectionSettings

Host = Literal["robot", "operator"]


class Child:
    """Child process that reads and writes lines of JSON, and ends when its standard input ends."""

    def __init__(self, module: str, *arguments: str, before: Sequence[str] = ()) -> None:
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        command = [*before, sys.executable, "-P", "-m", f"{__package__}.{module}", *arguments]
        self.name = module
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            # Ctrl-C reaches the parent alone, which then ends it.
            start_new_session=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def say(self, line: str) -> None:
        """Write a line to the process; FeelaheadError if the process has ended."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(line + "\n")
            self._process.stdin.flush()
        except OSError as error:
            raise FeelaheadError(f"wide area: the {self.name} has ended") from error

    def hear(self) -> dict[str, Any]:
        """Read the next line from the process; FeelaheadError if the process ends instead, or reports an error."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        said: dict[str, Any] = msgspec.json.decode(line) if line else {"error": f"the {self.name} has ended"}
        if "error" in said:
            raise FeelaheadError(f"wide area: {said['error']}")
        return said

    def last(self) -> dict[str, Any]:
        """Close the process's standard input; return the line that the process prints then."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        return self.hear()

    def end(self) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()


class WideArea(Child):
    """Running forwarder and its two hosts, as a context: at its end, hosts and programs are gone."""

    def __init__(self, ways: dict[Direction, DirectionSettings], control: str | None = None, seed: int = 0) -> None:
        """Start; FeelaheadError if root, `ip`, TUN devices or the congestion control `control` are missing."""
        if (missing := what_is_missing()) is not None:
            raise FeelaheadError(f"wide area: {missing}")
        super().__init__("forwarder")
        try:
            self.say(msgspec.json.encode(Order(ways, control, seed)).decode())
            self._namespaces: dict[str, str] = self.hear()["namespaces"]
        except BaseException:
            self.end()
            raise

    def surroundings(self, host: Host) -> list[str]:
        """Return the command prefix that runs a program on `host`."""
        return ["ip", "netns", "exec", self._namespaces[host], "env", f"PYTHONPATH={ROOT}"]

    def run(self, host: Host, module: str, *arguments: str) -> Child:
        return Child(module, *arguments, before=self.surroundings(host))

    def figures(self) -> dict[str, Any]:
        self.say("")
        return self.hear()


def what_is_missing() -> str | None:
    """Return why this machine cannot emulate a wide area, and the remedy; None if it can."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if shutil.which("ip") is None:
        return "no `ip` here (apt install iproute2)"
    if not Path("/dev/net/tun").exists():
        return "no /dev/net/tun here (modprobe tun; in a container: --device /dev/net/tun)"
    return None
