"""Export of a recording's episodes as a LeRobot dataset, v3.0, for learning from demonstrations.

Where the package lerobot is installed, its own writer writes the dataset, with pictures as video. Elsewhere
`PlainDataset` does, by the same calls.
"""

import importlib.metadata
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np

from common.errors import ConfigurationError, FeelaheadError
from common.recording.reading import Recording
from feelahead.recordings.demonstrations import Demonstrations, Picture
from feelahead.recordings.dictionary import FILE, JOINED, Column, column_of, table_of
from feelahead.recordings.jpeg import decoded, size_of
from feelahead.recordings.plain_dataset import VERSION, PlainDataset

_TASK: Final = "reach the target, grasp it, lift it and set it down"
_ENLARGED_QUALITY: Final = 90
_AGE: Final = "Time since the capture of this camera's picture in the frame"


def export_lerobot(recording: Recording, frames: Demonstrations, folder: Path) -> str:
    """Write the dataset into `folder`, which exists and is empty; return who wrote it, in words."""
    create, writer, how = _writer()
    try:
        _write(create, recording, frames, folder)
    except ConfigurationError:
        raise
    except (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError) as error:
        raise FeelaheadError(f"{writer} cannot write {folder}: {error}") from error
    return f"written by {writer}, pictures as {how}"


def _writer() -> tuple[Callable[..., Any], str, str]:
    """Return what makes a dataset, its name, and how it stores pictures, in words."""
    try:
        library = importlib.import_module("lerobot.datasets.lerobot_dataset")
    except (ImportError, OSError, RuntimeError) as error:  # the latter two: a torch that does not fit
        why = str(error).splitlines()[0]
    else:
        if library.CODEBASE_VERSION == VERSION:
            return library.LeRobotDataset.create, f"lerobot {importlib.metadata.version('lerobot')}", "video"
        why = f"lerobot writes {library.CODEBASE_VERSION}"
    return PlainDataset, "feelahead", f"JPEG ({why})"


def _write(create: Callable[..., Any], recording: Recording, frames: Demonstrations, folder: Path) -> None:
    values = {name: vector.values for name, vector in frames.vectors.items()} | _results(frames)
    features: dict[str, dict[str, Any]] = {}
    for name, column in values.items():
        parts = list(frames.vectors[name].names) if name in frames.vectors else None
        features[name] = {"dtype": str(column.dtype), "shape": (column.shape[1],), "names": parts}
    plain, seen = create is PlainDataset, {}
    for view, shown in frames.shown.items():
        key = f"observation.images.{view}"
        seen[key], (width, height) = _of_one_size(shown)
        features[key] = {"dtype": "image" if plain else "video", "shape": (height, width, 3)}
        features[key]["names"] = ["height", "width", "channels"]
    settings = recording.headers.get("robot", {}).get("settings", {})
    robot_type = Path(settings["model"]).stem if settings.get("model") else "feelahead"
    folder.rmdir()  # the writer makes it
    made = create(
        repo_id=f"feelahead/{recording.path.stem}",
        fps=frames.rate_hz,
        features=features,
        root=folder,
        robot_type=robot_type,
    )
    for one in frames.episodes:
        for row in range(one.first, one.end):
            pictures = {key: of[row].jpeg if plain else np.asarray(decoded(of[row].jpeg)) for key, of in seen.items()}
            made.add_frame({name: column[row] for name, column in values.items()} | pictures | {"task": _TASK})
        made.save_episode()
    made.finalize()
    _add_success(frames, folder)
    _write_dictionary(frames, folder)


def _results(frames: Demonstrations) -> dict[str, Any]:
    """Return the columns (n, 1) that say where episodes end and succeed; none if nobody said."""
    if all(one.success is None for one in frames.episodes):
        return {}
    done, success = (np.zeros((len(frames.times_s), 1), dtype=np.bool_) for _ in range(2))
    done[[one.end - 1 for one in frames.episodes]] = True
    success[[one.end - 1 for one in frames.episodes if one.success]] = True
    return {"next.done": done, "next.success": success}


def _of_one_size(shown: list[Picture]) -> tuple[list[Picture], tuple[int, int]]:
    """Enlarge pictures that were sent smaller over a narrow link, as the format allows one size only.

    Return the pictures and their (width, height).
    """
    sizes = [size_of(picture.jpeg) for picture in shown]
    largest = max(sizes)
    alike = []
    for picture, size in zip(shown, sizes, strict=True):
        if size == largest:
            alike.append(picture)
            continue
        enlarged = io.BytesIO()
        decoded(picture.jpeg).resize(largest).save(enlarged, "JPEG", quality=_ENLARGED_QUALITY)
        alike.append(picture._replace(jpeg=enlarged.getvalue()))
    return alike, largest


def _add_success(frames: Demonstrations, folder: Path) -> None:
    """Add to the episodes' metadata whether each succeeded; null if nobody said."""
    from pyarrow import array, bool_, parquet  # noqa: PLC0415

    for path in (folder / "meta" / "episodes").rglob("*.parquet"):
        table = parquet.read_table(path)
        success = [frames.episodes[number].success for number in table.column("episode_index").to_pylist()]
        parquet.write_table(table.append_column("success", array(success, bool_())), path)


def _write_dictionary(frames: Demonstrations, folder: Path) -> None:
    """Write the meaning of each part of each feature into `meta`; LeRobot's own columns are in its documentation."""
    lines = ["# Features", ""]
    for name, vector in frames.vectors.items():
        of = (column_of(JOINED, column) for column in vector.columns)
        parts = [one._replace(name=part, of=1) for part, one in zip(vector.names, of, strict=False)]
        parts = parts or [Column(part, "s", "", _AGE) for part in vector.names]
        lines += [f"## {name}", "", table_of(parts), ""]
    (folder / "meta" / FILE).write_text("\n".join(lines), encoding="utf-8")
