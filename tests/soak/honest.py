"""Examples of docs/drivers with a key: python -m tests.soak.honest SCRIPT ENDPOINT FOLDER NAME."""

import runpy
import sys
from pathlib import Path
from typing import Any

import zmq

from common.sockets.authentication import OperatorKeys
from common.sockets.keys import KeyFolder


def main(script: str, endpoint: str, folder: str, name: str) -> None:
    """Run an example, with a key in each of its sockets."""
    keys = OperatorKeys.load(Path(folder) / name, str(KeyFolder(Path(folder) / "robot").public_path("robot")))

    class Context(zmq.Context[Any]):
        def socket(self, *arguments: Any, **more: Any) -> Any:
            part = super().socket(*arguments, **more)
            keys.secure(part)
            return part

    zmq.Context = Context  # type: ignore[misc]
    sys.argv = [script, endpoint]
    runpy.run_path(script, run_name="__main__")


if __name__ == "__main__":
    main(*sys.argv[1:])
