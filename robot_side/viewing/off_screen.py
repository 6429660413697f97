"""Which of MuJoCo's ways to render without a screen works on this machine.

MuJoCo and PyOpenGL settle on one when they are imported, so that another one takes another process.
"""

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

BACKENDS: Final = ("egl", "osmesa") if sys.platform == "linux" else ("",)
"""In the order in which they are tried; the empty one is what MuJoCo takes by itself."""
REMEDY: Final = "sudo apt-get install libegl1 libgl1-mesa-dri (or: libosmesa6)"


def choose(backend: str) -> None:
    """Take `backend`, before MuJoCo is imported for the first time."""
    if backend:
        os.environ["MUJOCO_GL"] = backend
    os.environ.pop("PYOPENGL_PLATFORM", None)
    # Mesa would take every processor, also the one that ticks.
    os.environ.setdefault("LP_NUM_THREADS", "0")


def trouble_with(backend: str) -> str | None:
    """Why nothing can be rendered by way of `backend`, in one line; None if it can. In a process of its own."""
    choose(backend)
    try:
        with silenced():
            import mujoco  # type: ignore[import-untyped]  # noqa: PLC0415  # only now is chosen how it renders

            context = mujoco.GLContext(16, 16)
            context.make_current()
            context.free()
    except Exception as error:
        said = str(error).strip().splitlines() or [type(error).__name__]
        return f"{backend or 'OpenGL'}: {said[0][:200]}"
    return None


@contextlib.contextmanager
def silenced() -> Iterator[None]:
    """What drivers write to standard error by themselves is not for people."""
    sys.stderr.flush()
    kept = os.dup(2)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
