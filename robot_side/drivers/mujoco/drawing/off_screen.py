"""Choice of MuJoCo's off-screen rendering backend on this machine.

MuJoCo and PyOpenGL fix the backend when they are imported, so another backend needs another process.
"""

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

BACKENDS: Final = ("egl", "osmesa") if sys.platform == "linux" else ("",)
"""Backends in the order in which they are tried; the empty name is MuJoCo's default."""
REMEDY: Final = "sudo apt-get install libegl1 libgl1-mesa-dri (or: libosmesa6)"


def choose(backend: str) -> None:
    """Select `backend`, before MuJoCo is imported for the first time."""
    if backend:
        os.environ["MUJOCO_GL"] = backend
    os.environ.pop("PYOPENGL_PLATFORM", None)
    # Mesa would use every processor, also the one that ticks.
    os.environ.setdefault("LP_NUM_THREADS", "0")


def choose_late() -> None:
    """Let MuJoCo's renderers draw off screen in this process, although it was imported before a backend was chosen.

    ImportError without EGL's libraries. What a user has chosen stays.
    """
    if BACKENDS[0] and not os.environ.get("MUJOCO_GL"):
        choose(BACKENDS[0])
        import mujoco  # type: ignore[import-untyped]  # noqa: PLC0415  # after the choice of a backend
        from mujoco.egl import GLContext  # type: ignore[import-untyped]  # noqa: PLC0415

        sys.modules[mujoco.Renderer.__module__].gl_context.GLContext = GLContext


def trouble_with(backend: str) -> str | None:
    """Return the fault of `backend`, in one line; None if it works. To be called in its own process."""
    choose(backend)
    try:
        with silenced():
            import mujoco  # noqa: PLC0415  # after the choice of a backend

            context = mujoco.GLContext(16, 16)
            context.make_current()
            context.free()
    except Exception as error:
        said = str(error).strip().splitlines() or [type(error).__name__]
        return f"{backend or 'OpenGL'}: {said[0][:200]}"
    return None


@contextlib.contextmanager
def silenced() -> Iterator[None]:
    """Discard standard error meanwhile, because graphics drivers write to it directly."""
    sys.stderr.flush()
    kept = os.dup(2)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
