"""Export of a recording's episodes as a LeRobot dataset, v3.0, for learning from demonstrations.

Where the package lerobot is installed, its own writer writes the dataset, with pictures as video. Elsewhere:

data/chunk-000/file-000.parquet            one row for each frame, pictures as encoded bytes
meta/info.json, stats.json, tasks.parquet
meta/episodes/chunk-000/file-000.parquet   one row for each episode
"""

import importlib.metadata
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError, FeelaheadError
from common.recording.reading import Recording
from feelahead.recordings.demonstrations import Demonstrations, Episode, Picture
from feelahead.recordings.dictionary import FILE, JOINED, Column, column_of, table_of
from feelahead.recordings.jpeg import decoded, size_of

_VERSION: Final = "v3.0"
_FILE: Final = "chunk-{chunk_index:03d}/file-{file_index:03d}"
_TASK: Final = "reach the target, grasp it, lift it and set it down"
_SAMPLED_PICTURES: Final = 20
"""About the maximum number of pictures from which the statistics are computed."""
_SAMPLED_PIXELS: Final = 640
"""Maximum number of pixels of each row and column from which they are computed."""
_ENLARGED_QUALITY: Final = 90
_AGE: Final = "Time since the capture of this camera's picture in the frame"


def export_lerobot(recording: Recording, frames: Demonstrations, folder: Path) -> str:
    """Write the dataset into `folder`, which exists and is empty; return who wrote it, in words."""
    try:
        library = importlib.import_module("lerobot.datasets.lerobot_dataset")
    except (ImportError, OSError, RuntimeError) as error:  # the latter two: a torch that does not fit
        why = str(error).splitlines()[0]
    else:
        if library.CODEBASE_VERSION == _VERSION:
            writer = f"lerobot {importlib.metadata.version('lerobot')}"
            try:
                _write_by(library, recording, frames, folder)
            except ConfigurationError:
                raise
            except (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError) as error:
                raise FeelaheadError(f"{writer} cannot write {folder}: {error}") from error
            _write_dictionary(frames, folder)
            return f"written by {writer}, pictures as video"
        why = f"lerobot writes {library.CODEBASE_VERSION}"
    _write(recording, frames, folder)
    _write_dictionary(frames, folder)
    return f"written by feelahead, pictures as JPEG ({why})"


def _write_dictionary(frames: Demonstrations, folder: Path) -> None:
    """Write the meaning of each part of each feature into `meta`; LeRobot's own columns are in its documentation."""
    lines = ["# Features", ""]
    for name, vector in frames.vectors.items():
        of = (column_of(JOINED, column) for column in vector.columns)
        parts = [one._replace(name=part, of=1) for part, one in zip(vector.names, of, strict=False)]
        parts = parts or [Column(part, "s", "", _AGE) for part in vector.names]
        lines += [f"## {name}", "", table_of(parts), ""]
    (folder / "meta" / FILE).write_text("\n".join(lines), encoding="utf-8")


def _write_by(library: Any, recording: Recording, frames: Demonstrations, folder: Path) -> None:
    """Write the dataset by LeRobot's own writer, and add the episodes' success to its metadata."""
    from pyarrow import array, bool_, parquet  # noqa: PLC0415

    values = {name: vector.values for name, vector in frames.vectors.items()} | _results(frames)
    features, seen = _features(frames, values, "video")
    folder.rmdir()  # the writer makes it
    made = library.LeRobotDataset.create(
        repo_id=f"feelahead/{recording.path.stem}",
        fps=frames.rate_hz,
        features={name: feature | {"shape": tuple(feature["shape"])} for name, feature in features.items()},
        root=folder,
        robot_type=_robot_type(recording),
    )
    for one in frames.episodes:
        for row in range(one.first, one.end):
            shown = {key: np.asarray(decoded(of[row].jpeg)) for key, of in seen.items()}
            made.add_frame({name: column[row] for name, column in values.items()} | shown | {"task": _TASK})
        made.save_episode()
    made.finalize()
    for path in (folder / "meta" / "episodes").rglob("*.parquet"):
        table = parquet.read_table(path)
        success = [frames.episodes[number].success for number in table.column("episode_index").to_pylist()]
        parquet.write_table(table.append_column("success", array(success, bool_())), path)


def _write(recording: Recording, frames: Demonstrations, folder: Path) -> None:
    import pyarrow  # noqa: PLC0415
    from pyarrow import parquet  # noqa: PLC0415

    values: dict[str, Any] = {name: vector.values for name, vector in frames.vectors.items()} | _counters(frames)
    features, seen = _features(frames, values, "image")
    columns: dict[str, Any] = {}
    for name, column in values.items():
        columns[name] = pyarrow.array(column.ravel())
        if name in frames.vectors:
            columns[name] = pyarrow.FixedSizeListArray.from_arrays(columns[name], column.shape[1])
    for key, shown in seen.items():
        columns[key] = pyarrow.array(
            [{"bytes": picture.jpeg, "path": f"frame-{row:06d}.jpg"} for row, picture in enumerate(shown)],
            type=pyarrow.struct([("bytes", pyarrow.binary()), ("path", pyarrow.string())]),
        )

    def stats(first: int, end: int) -> dict[str, Any]:
        numbers = {name: _statistics(column[first:end].astype(np.float64)) for name, column in values.items()}
        return numbers | {key: _picture_statistics(shown[first:end]) for key, shown in seen.items()}

    table = pyarrow.table(columns)
    hints = {"info": {"features": {name: _hint(feature) for name, feature in features.items()}}}
    table = table.replace_schema_metadata({"huggingface": json.dumps(hints)})
    parquet.write_table(table, _made(folder / "data" / _first_file()), compression="snappy")
    parquet.write_table(_tasks(pyarrow), _made(folder / "meta" / "tasks.parquet"))
    rows = [_episode(number, one, stats(one.first, one.end)) for number, one in enumerate(frames.episodes)]
    parquet.write_table(pyarrow.Table.from_pylist(rows), _made(folder / "meta" / "episodes" / _first_file()))
    info = _info(recording, features, frames)
    (folder / "meta" / "info.json").write_text(json.dumps(info, indent=4) + "\n")
    (folder / "meta" / "stats.json").write_text(json.dumps(stats(0, len(frames.times_s)), indent=4) + "\n")


def _features(
    frames: Demonstrations, values: Mapping[str, Any], pictures: str
) -> tuple[dict[str, dict[str, Any]], dict[str, list[Picture]]]:
    """Return the description of each feature, and each camera's pictures, all of one size.

    pictures: `image` or `video`.
    """
    features: dict[str, dict[str, Any]] = {}
    for name, column in values.items():
        parts = list(frames.vectors[name].names) if name in frames.vectors else None
        features[name] = {"dtype": str(column.dtype), "shape": [column.shape[1]], "names": parts}
    seen = {}
    for view, shown in frames.shown.items():
        key = f"observation.images.{view}"
        seen[key], (width, height) = _of_one_size(shown)
        features[key] = {"dtype": pictures, "shape": [height, width, 3], "names": ["height", "width", "channels"]}
    return features, seen


def _counters(frames: Demonstrations) -> dict[str, Any]:
    """Return the columns (n, 1) that number the frames, and `_results`."""
    count = len(frames.times_s)
    lengths = [one.end - one.first for one in frames.episodes]
    within = np.concatenate([np.arange(length) for length in lengths])
    counters = {
        "timestamp": (within / frames.rate_hz).astype(np.float32),
        "frame_index": within,
        "episode_index": np.repeat(np.arange(len(lengths)), lengths),
        "index": np.arange(count),
        "task_index": np.zeros(count, dtype=np.int64),
    }
    return {name: values[:, None] for name, values in counters.items()} | _results(frames)


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


def _statistics(values: FloatArray) -> dict[str, Any]:
    shares = {f"q{round(100 * share):02d}": np.quantile(values, share, axis=0) for share in (0.01, 0.1, 0.5, 0.9, 0.99)}
    figures = {name: getattr(values, name)(axis=0) for name in ("min", "max", "mean", "std")} | shares
    return {name: figure.tolist() for name, figure in figures.items()} | {"count": [len(values)]}


def _picture_statistics(shown: list[Picture]) -> dict[str, Any]:
    """Return each statistic of the pictures' colours, 0 to 1, in the shape (3, 1, 1)."""
    step = max(1, len(shown) // _SAMPLED_PICTURES)
    points = []
    for one in shown[::step]:
        colors = np.asarray(decoded(one.jpeg))
        apart = -(-max(colors.shape) // _SAMPLED_PIXELS)
        points.append(colors[::apart, ::apart].reshape(-1, 3))
    found = _statistics(np.concatenate(points) / 255.0)
    return {name: values if name == "count" else [[[value]] for value in values] for name, values in found.items()} | {
        "count": [len(points)]
    }


def _hint(feature: Mapping[str, Any]) -> dict[str, Any]:
    """Return the description of a column that Hugging Face's library `datasets` expects."""
    if feature["dtype"] == "image":
        return {"_type": "Image"}
    if feature["shape"] == [1]:
        return {"dtype": feature["dtype"], "_type": "Value"}
    value = {"dtype": feature["dtype"], "_type": "Value"}
    return {"feature": value, "length": feature["shape"][0], "_type": "Sequence"}


def _tasks(pyarrow: Any) -> Any:
    """Return the table of tasks. Their texts are the index of a pandas data frame, as the format's reader expects."""
    table = pyarrow.table({"task_index": np.zeros(1, dtype=np.int64), "task": [_TASK]})
    frame = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            {"name": "task_index", "field_name": "task_index", "pandas_type": "int64", "numpy_type": "int64"},
            {"name": "task", "field_name": "task", "pandas_type": "unicode", "numpy_type": "object"},
        ],
        "pandas_version": "2.2.0",
    }
    return table.replace_schema_metadata({"pandas": json.dumps(frame)})


def _episode(number: int, episode: Episode, stats: Mapping[str, Any]) -> dict[str, Any]:
    row: dict[str, Any] = {"episode_index": number, "tasks": [_TASK], "length": episode.end - episode.first}
    row |= {"data/chunk_index": 0, "data/file_index": 0}
    row |= {"dataset_from_index": episode.first, "dataset_to_index": episode.end, "success": episode.success}
    row |= {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
    return row | {f"stats/{name}/{figure}": value for name, found in stats.items() for figure, value in found.items()}


def _info(recording: Recording, features: Mapping[str, Any], frames: Demonstrations) -> dict[str, Any]:
    return {
        "codebase_version": _VERSION,
        "robot_type": _robot_type(recording),
        "total_episodes": len(frames.episodes),
        "total_frames": len(frames.times_s),
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 500,
        "fps": frames.rate_hz,
        "splits": {"train": f"0:{len(frames.episodes)}"},
        "data_path": f"data/{_FILE}.parquet",
        "video_path": None,
        "features": features,
    }


def _robot_type(recording: Recording) -> str:
    settings = recording.headers.get("robot", {}).get("settings", {})
    return Path(settings["model"]).stem if settings.get("model") else "feelahead"


def _first_file() -> str:
    return _FILE.format(chunk_index=0, file_index=0) + ".parquet"


def _made(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path
