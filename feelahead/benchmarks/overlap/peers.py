"""The published package `overlap` 0.2.0 on the same pairs: from Python, and its C++ header by itself.

Both are optional: `available` says what is missing and how to get it. The package takes one pair a call, wants
its corners in an order of its own, and returns volumes only.
"""

import importlib.util
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from common.arrays import FloatArray
from common.clock import Clock
from feelahead.benchmarks.overlap.pairs import Pairs

SDIST = "pip download --no-deps --no-binary overlap overlap==0.2.0"
_EIGEN = (Path("/usr/include/eigen3"), Path("/usr/local/include/eigen3"), Path("/opt/homebrew/include/eigen3"))
_HEXAHEDRON = (0, 4, 6, 2, 1, 5, 7, 3)
"""The corners of `overlap_pairs.BOX_SIGNS` round the bottom and then the top, as the package wants them."""
_COMPILE_TIMEOUT_S = 180.0
_RUN_TIMEOUT_S = 120.0
_AT_ONCE = 128
"""Pairs of a part that is timed by itself."""


@dataclass(frozen=True)
class PeerTiming:
    """The least ns of building the package's objects, and of the overlaps of those, by parts; the volumes (p,)."""

    building_ns: FloatArray
    parts_ns: FloatArray
    volumes: FloatArray

    @property
    def overlap_ns(self) -> float:
        """The overlaps' ns a pair."""
        return float(self.parts_ns.sum()) / len(self.volumes)


def package_corners(pairs: Pairs, *, mend: bool = True) -> FloatArray:
    """(p, 4 or 8, 3): the corners in the package's order; `mend` turns inverted tetrahedra round."""
    corners = pairs.corners
    if pairs.solid == "box":
        # A rotation that mirrors turns the box inside out, which the package would take for a negative volume.
        mirrored = np.linalg.det(pairs.parameters[1]) < 0.0
        ordered = corners[:, list(_HEXAHEDRON)]
        ordered[mirrored] = ordered[mirrored][:, [4, 5, 6, 7, 0, 1, 2, 3]]
        return np.ascontiguousarray(ordered)
    if mend:
        corners = corners.copy()
        inverted = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0.0
        corners[inverted] = corners[inverted][:, [0, 1, 3, 2]]
    return np.ascontiguousarray(corners)


class PythonPeer:
    """The package from Python."""

    def __init__(self) -> None:
        self.missing = (
            "" if importlib.util.find_spec("overlap") is not None else "not installed: pip install 'feelahead[bench]'"
        )

    def volumes(self, pairs: Pairs, *, mend: bool = True) -> tuple[FloatArray, int]:
        """(Volumes (p,) with NaN for an exception, how many exceptions)."""
        package: Any = importlib.import_module("overlap")
        volumes, exceptions = np.full(len(pairs), np.nan), 0
        for row, corners in enumerate(package_corners(pairs, mend=mend)):
            try:
                solid = _element(package, pairs)(corners)
                sphere = package.Sphere(pairs.centers[row], float(pairs.radii[row]))
                volumes[row] = package.overlap_volume(sphere, solid)
            except (ValueError, RuntimeError):
                exceptions += 1
        return volumes, exceptions

    def timing(self, pairs: Pairs, repeats: int, clock: Clock) -> PeerTiming:
        """One call after another, the objects built beforehand."""
        package: Any = importlib.import_module("overlap")
        corners, overlap_volume = package_corners(pairs), package.overlap_volume
        element = _element(package, pairs)
        starts = range(0, len(pairs), _AT_ONCE)
        times_s = np.full((2, len(starts)), np.inf)
        volumes: list[float] = []
        for _ in range(repeats):
            volumes = []
            for part, first in enumerate(starts):
                rows = slice(first, first + _AT_ONCE)
                start_s = clock.now()
                centers, radii = pairs.centers[rows], pairs.radii[rows].tolist()
                spheres = [package.Sphere(center, radius) for center, radius in zip(centers, radii, strict=True)]
                solids = [element(corner) for corner in corners[rows]]
                built_s = clock.now()
                volumes += [overlap_volume(sphere, solid) for sphere, solid in zip(spheres, solids, strict=True)]
                taken_s = built_s - start_s, clock.now() - built_s
                times_s[:, part] = np.minimum(times_s[:, part], taken_s)
        return PeerTiming(1e9 * times_s[0], 1e9 * times_s[1], np.array(volumes))


def _element(package: Any, pairs: Pairs) -> Any:
    return package.Tetrahedron if pairs.solid == "tetrahedron" else package.Hexahedron


class HeaderPeer:
    """The package's header, compiled into the driver beside this file with -O3 -march=native.

    `header` is the path of overlap.hpp; its source distribution has it (`SDIST`).
    """

    def __init__(self, header: Path | None) -> None:
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self.compiler = next((path for name in ("c++", "g++", "clang++") if (path := shutil.which(name))), None)
        eigen = next((path for path in _EIGEN if path.is_dir()), None)
        if header is None:
            self.missing = f"no header: {SDIST}, unpack it, --peer-header .../include/overlap/overlap.hpp"
        elif self.compiler is None:
            self.missing = "no C++ compiler (c++, g++ or clang++ in the PATH)"
        elif eigen is None:
            self.missing = "no Eigen: apt-get install libeigen3-dev"
        else:
            self.missing = self._compile(self.compiler, header, eigen)

    def _compile(self, compiler: str, header: Path, eigen: Path) -> str:
        """Build the driver; what went wrong, or nothing."""
        self._folder = tempfile.TemporaryDirectory(prefix="feelahead-peer-")
        source = Path(__file__).with_name("peer_driver.cpp")
        flags = ["-std=c++17", "-O3", "-march=native", "-DNDEBUG", f"-I{header.parent}", f"-isystem{eigen}"]
        try:
            done = subprocess.run(
                [compiler, *flags, str(source), "-o", str(self._driver)],
                capture_output=True,
                text=True,
                timeout=_COMPILE_TIMEOUT_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            self.close()
            return f"compiling took more than {_COMPILE_TIMEOUT_S:g} s"
        if done.returncode != 0:
            self.close()
            first = next((line for line in done.stderr.splitlines() if "error" in line), "unknown error")
            return f"does not compile: {first[:200]}"
        return ""

    @property
    def _driver(self) -> Path:
        assert self._folder is not None  # noqa: S101
        return Path(self._folder.name) / "peer_driver"

    def timing(self, pairs: Pairs, repeats: int, *, mend: bool = True) -> PeerTiming:
        """All pairs in a process of its own; OSError when that fails."""
        assert self._folder is not None  # noqa: S101
        corners = package_corners(pairs, mend=mend)
        rows = np.concatenate([pairs.centers, pairs.radii[:, None], corners.reshape(len(pairs), -1)], axis=1)
        given, found = (Path(self._folder.name) / name for name in ("pairs", "volumes"))
        given.write_bytes(np.array([len(pairs), corners.shape[1]], np.int64).tobytes() + rows.tobytes())
        done = subprocess.run(
            [str(self._driver), str(given), str(found), str(repeats)],
            capture_output=True,
            text=True,
            timeout=_RUN_TIMEOUT_S,
            check=False,
        )
        if done.returncode != 0:
            raise OSError(f"the C++ driver ended with code {done.returncode}")
        building_ns, parts_ns = (np.array(line.split(), float) for line in done.stdout.splitlines())
        return PeerTiming(building_ns, parts_ns, np.fromfile(found))

    def close(self) -> None:
        """Remove the driver."""
        if self._folder is not None:
            self._folder.cleanup()
