"""Run the published package `overlap` 0.2.0 on the same pairs: from Python, and its C++ header alone.

Both are optional: `missing` names the missing part and how to get it. The package takes one pair a call, has another
order of corners, and returns volumes only.
"""

import importlib.util
import shutil
import subprocess
import tempfile
import weakref
from pathlib import Path
from typing import Any

import numpy as np

from common.arrays import FloatArray
from common.extras import installing
from feelahead.lab.reference.pairs import Pairs

SDIST = "pip download --no-deps --no-binary overlap overlap==0.2.0"
_EIGEN = (Path("/usr/include/eigen3"), Path("/usr/local/include/eigen3"), Path("/opt/homebrew/include/eigen3"))
_HEXAHEDRON = (0, 4, 6, 2, 1, 5, 7, 3)
"""Order of corners in the package: indices into `pairs.BOX_SIGNS`, around the bottom, then around the top."""
_TIMEOUT_S = 180.0
_REPEATS = "2"


def package_corners(pairs: Pairs, *, mend: bool = True) -> FloatArray:
    """Return the corners (p, 4 or 8, 3) in the package's order. mend: reorder those of inverted tetrahedra."""
    corners = pairs.corners
    if pairs.solid == "box":
        # A rotation that mirrors turns the box inside out: the package would compute a negative volume.
        mirrored = np.linalg.det(pairs.parameters[1]) < 0.0
        ordered = corners[:, list(_HEXAHEDRON)]
        ordered[mirrored] = ordered[mirrored][:, [4, 5, 6, 7, 0, 1, 2, 3]]
        return np.ascontiguousarray(ordered)
    if mend:
        corners = corners.copy()
        inverted = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0.0
        corners[inverted] = corners[inverted][:, [0, 1, 3, 2]]
    return np.ascontiguousarray(corners)


class PythonPackage:
    """The package from Python."""

    def __init__(self) -> None:
        found = importlib.util.find_spec("overlap") is not None
        self.missing = "" if found else f"not installed; to install it: {installing('bench')}"

    def volumes(self, pairs: Pairs, *, mend: bool = True) -> FloatArray:
        """Return volumes (p,); NaN for pairs with which the package raises an exception."""
        package: Any = importlib.import_module("overlap")
        volumes = np.full(len(pairs), np.nan)
        element = package.Tetrahedron if pairs.solid == "tetrahedron" else package.Hexahedron
        for row, corners in enumerate(package_corners(pairs, mend=mend)):
            try:
                sphere = package.Sphere(pairs.centers[row], float(pairs.radii[row]))
                volumes[row] = package.overlap_volume(sphere, element(corners))
            except (ValueError, RuntimeError):
                continue
        return volumes


class CompiledHeader:
    """The package's header, overlap.hpp of the source distribution, compiled into the driver beside this file."""

    def __init__(self, header: Path | None) -> None:
        folder = tempfile.mkdtemp(prefix="feelahead-peer-")
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self._driver = Path(folder) / "peer_driver"
        compiler = next((path for name in ("c++", "g++", "clang++") if (path := shutil.which(name))), None)
        eigen = next((path for path in _EIGEN if path.is_dir()), None)
        if header is None:
            self.missing = (
                f"its header is not given; to get it: {SDIST}; unpack it, then give"
                " --peer-header .../include/overlap/overlap.hpp"
            )
        elif compiler is None:
            self.missing = "no C++ compiler (c++, g++ or clang++ in the PATH)"
        elif eigen is None:
            self.missing = "no Eigen: apt-get install libeigen3-dev"
        else:
            flags = ["-std=c++17", "-O3", "-march=native", "-DNDEBUG", f"-I{header.parent}", f"-isystem{eigen}"]
            source = Path(__file__).with_name("peer_driver.cpp")
            said = _run([compiler, *flags, str(source), "-o", str(self._driver)])
            errors = [line for line in said.stderr.splitlines() if "error" in line]
            self.missing = f"does not compile: {(errors or ['unknown error'])[0][:200]}" if said.returncode else ""

    def timed(self, pairs: Pairs) -> tuple[FloatArray, FloatArray]:
        """Compute all pairs twice in another process; return the least times in ns (parts,), and the volumes (p,)."""
        corners = package_corners(pairs)
        rows = np.concatenate([pairs.centers, pairs.radii[:, None], corners.reshape(len(pairs), -1)], axis=1)
        given, found = (self._driver.with_name(name) for name in ("pairs", "volumes"))
        given.write_bytes(np.array([len(pairs), corners.shape[1]], np.int64).tobytes() + rows.tobytes())
        done = _run([str(self._driver), str(given), str(found), _REPEATS])
        if done.returncode != 0:
            raise OSError(f"the C++ driver ended with code {done.returncode}")
        _, parts_ns = done.stdout.splitlines()
        return np.array(parts_ns.split(), float), np.fromfile(found)


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False)
