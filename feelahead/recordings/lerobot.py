"""Export of a recording's episodes as a LeRobot dataset, v3.0, for learning from demonstrations.

data/chunk-000/file-000.parquet            one row for each frame, pictures as encoded bytes
meta/info.json, stats.json, tasks.parquet
meta/episodes/chunk-000/file-000.parquet   one row for each episode
"""

import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from common.recording.reading import Recording
from feelahead.recordings.demonstrations import Demonstrations, Episode, Picture

_VERSION: Final = "v3.0"
_FILE: Final = "chunk-{chunk_index:03d}/file-{file_index:03d}"
_TASK: Final = "reach the target, grasp it, lift it and set it down"
_SAMPLED_PICTURES: Final = 20
"""About the maximum number of pictures from which the statistics are computed."""
_ENLARGED_QUALITY: Final = 90


def export_lerobot(recording: Recording, frames: Demonstrations, folder: Path) -> None:
    """Write the dataset into `folder`."""
    import pyarrow  # noqa: PLC0415
    from pyarrow import parquet  # noqa: PLC0415

    values: dict[str, Any] = {name: vector.values for name, vector in frames.vectors.items()}
    values |= _counters(frames)
    features: dict[str, Any] = {}
    columns: dict[str, Any] = {}
    for name, column in values.items():
        parts = frames.vectors[name].names if name in frames.vectors else None
        features[name] = {"dtype": str(column.dtype), "shape": [1], "names": None}
        columns[name] = pyarrow.array(column.ravel())
        if parts is not None:
            features[name] |= {"shape": [len(parts)], "names": list(parts)}
            columns[name] = pyarrow.FixedSizeListArray.from_arrays(columns[name], len(parts))
    seen: dict[str, list[Picture]] = {}
    for view, pictures in frames.shown.items():
        key = f"observation.images.{view}"
        seen[key], (width, height) = _of_one_size(pictures)
        features[key] = {"dtype": "image", "shape": [height, width, 3], "names": ["height", "width", "channels"]}
        columns[key] = pyarrow.array(
            [{"bytes": picture.jpeg, "path": f"frame-{row:06d}.jpg"} for row, picture in enumerate(seen[key])],
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


def _counters(frames: Demonstrations) -> dict[str, Any]:
    """Return the columns (n, 1) that number the frames, and say where episodes end and succeed if anybody said."""
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
    if any(one.success is not None for one in frames.episodes):
        done, success = np.zeros(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_)
        done[[one.end - 1 for one in frames.episodes]] = True
        success[[one.end - 1 for one in frames.episodes if one.success]] = True
        counters |= {"next.done": done, "next.success": success}
    return {name: values[:, None] for name, values in counters.items()}


def _of_one_size(shown: list[Picture]) -> tuple[list[Picture], tuple[int, int]]:
    """Enlarge pictures that were sent smaller over a narrow link, as the format allows one size only.

    Return the pictures and their (width, height).
    """
    from PIL import Image  # noqa: PLC0415

    opened = [Image.open(io.BytesIO(picture.jpeg)) for picture in shown]
    largest = max(one.size for one in opened)
    alike = []
    for picture, one in zip(shown, opened, strict=True):
        if one.size == largest:
            alike.append(picture)
            continue
        enlarged = io.BytesIO()
        one.resize(largest).save(enlarged, "JPEG", quality=_ENLARGED_QUALITY)
        alike.append(picture._replace(jpeg=enlarged.getvalue()))
    return alike, largest


def _statistics(values: FloatArray) -> dict[str, Any]:
    shares = {f"q{round(100 * share):02d}": np.quantile(values, share, axis=0) for share in (0.01, 0.1, 0.5, 0.9, 0.99)}
    figures = {name: getattr(values, name)(axis=0) for name in ("min", "max", "mean", "std")} | shares
    return {name: figure.tolist() for name, figure in figures.items()} | {"count": [len(values)]}


def _picture_statistics(shown: list[Picture]) -> dict[str, Any]:
    """Return each statistic of the pictures' colours, 0 to 1, in the shape (3, 1, 1)."""
    from PIL import Image  # noqa: PLC0415

    step = max(1, len(shown) // _SAMPLED_PICTURES)
    points = [np.asarray(Image.open(io.BytesIO(one.jpeg)).convert("RGB")).reshape(-1, 3) for one in shown[::step]]
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
    settings = recording.headers.get("robot", {}).get("settings", {})
    return {
        "codebase_version": _VERSION,
        "robot_type": Path(settings["model"]).stem if settings.get("model") else "feelahead",
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


def _first_file() -> str:
    return _FILE.format(chunk_index=0, file_index=0) + ".parquet"


def _made(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path
