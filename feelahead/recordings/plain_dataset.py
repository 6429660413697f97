"""LeRobot dataset, v3.0, written by the calls of the package lerobot's own writer, where that is not installed.

data/chunk-000/file-000.parquet            one row for each frame, pictures as encoded bytes
meta/info.json, stats.json, tasks.parquet
meta/episodes/chunk-000/file-000.parquet   one row for each episode
"""

import json
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from common.arrays import FloatArray
from feelahead.recordings.jpeg import decoded

VERSION: Final = "v3.0"
_FILE: Final = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_SAMPLED_PICTURES: Final = 20
"""About the maximum number of pictures from which the statistics are computed"""
_SAMPLED_PIXELS: Final = 640
"""Maximum number of pixels of each row and column from which they are computed"""


class PlainDataset:
    """Dataset that is written at its end. Pictures are given as JPEG, and stay so."""

    def __init__(
        self, *, repo_id: str, fps: int, features: Mapping[str, dict[str, Any]], root: Path, robot_type: str
    ) -> None:
        del repo_id
        self._fps, self._features, self._root, self._robot_type = fps, features, root, robot_type
        self._frames: list[Mapping[str, Any]] = []
        self._bounds = [0]

    def add_frame(self, frame: Mapping[str, Any]) -> None:
        """Add a frame to the present episode: each feature's array or JPEG, and the `task` in words."""
        self._frames.append(frame)

    def save_episode(self) -> None:
        """End the present episode."""
        self._bounds.append(len(self._frames))

    def finalize(self) -> None:
        """Write everything."""
        import pyarrow  # noqa: PLC0415
        from pyarrow import parquet  # noqa: PLC0415

        counters = _counters(self._bounds, self._fps)
        columns: dict[str, Any] = {
            name: [frame[name] for frame in self._frames]
            if _shows(feature)
            else np.stack([f[name] for f in self._frames])
            for name, feature in self._features.items()
        } | counters
        features = dict(self._features) | {
            name: {"dtype": str(values.dtype), "shape": (1,), "names": None} for name, values in counters.items()
        }

        def stats(first: int, end: int) -> dict[str, Any]:
            return {
                name: (_picture_statistics if _shows(feature) else _statistics)(columns[name][first:end])
                for name, feature in features.items()
            }

        table = pyarrow.table({name: _column(pyarrow, columns[name], feature) for name, feature in features.items()})
        hints = {"info": {"features": {name: _hint(feature) for name, feature in features.items()}}}
        table = table.replace_schema_metadata({"huggingface": json.dumps(hints)})
        parquet.write_table(table, self._made("data"), compression="snappy")
        task = self._frames[0]["task"]
        rows = [_episode(number, *span, task, stats(*span)) for number, span in enumerate(pairwise(self._bounds))]
        parquet.write_table(pyarrow.Table.from_pylist(rows), self._made("meta/episodes"))
        meta = self._root / "meta"
        parquet.write_table(_tasks(pyarrow, task), meta / "tasks.parquet")
        (meta / "info.json").write_text(json.dumps(self._info(features), indent=4) + "\n")
        (meta / "stats.json").write_text(json.dumps(stats(0, len(self._frames)), indent=4) + "\n")

    def _made(self, folder: str) -> Path:
        path = self._root / folder / _FILE.format(chunk_index=0, file_index=0)
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def _info(self, features: Mapping[str, Any]) -> dict[str, Any]:
        count = len(self._bounds) - 1
        return {
            "codebase_version": VERSION,
            "robot_type": self._robot_type,
            "total_episodes": count,
            "total_frames": len(self._frames),
            "total_tasks": 1,
            "chunks_size": 1000,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 500,
            "fps": self._fps,
            "splits": {"train": f"0:{count}"},
            "data_path": f"data/{_FILE}",
            "video_path": None,
            "features": features,
        }


def _shows(feature: Mapping[str, Any]) -> bool:
    """Return whether the feature is a picture."""
    return bool(feature["dtype"] == "image")


def _counters(bounds: list[int], fps: int) -> dict[str, Any]:
    """Return the columns (n, 1) that number the frames."""
    lengths = np.diff(bounds)
    within = np.concatenate([np.arange(length) for length in lengths])
    counters = {
        "timestamp": (within / fps).astype(np.float32),
        "frame_index": within,
        "episode_index": np.repeat(np.arange(len(lengths)), lengths),
        "index": np.arange(len(within)),
        "task_index": np.zeros(len(within), dtype=np.int64),
    }
    return {name: values[:, None] for name, values in counters.items()}


def _column(pyarrow: Any, values: Any, feature: Mapping[str, Any]) -> Any:
    if _shows(feature):
        kind = pyarrow.struct([("bytes", pyarrow.binary()), ("path", pyarrow.string())])
        rows = [{"bytes": jpeg, "path": f"frame-{row:06d}.jpg"} for row, jpeg in enumerate(values)]
        return pyarrow.array(rows, type=kind)
    flat, (count,) = pyarrow.array(values.ravel()), feature["shape"]
    return flat if count == 1 else pyarrow.FixedSizeListArray.from_arrays(flat, count)


def _hint(feature: Mapping[str, Any]) -> dict[str, Any]:
    """Return the description of a column that Hugging Face's library `datasets` expects."""
    if _shows(feature):
        return {"_type": "Image"}
    value, (count,) = {"dtype": feature["dtype"], "_type": "Value"}, feature["shape"]
    return value if count == 1 else {"feature": value, "length": count, "_type": "Sequence"}


def _statistics(values: FloatArray) -> dict[str, Any]:
    values = values.astype(np.float64)
    shares = {f"q{round(100 * share):02d}": np.quantile(values, share, axis=0) for share in (0.01, 0.1, 0.5, 0.9, 0.99)}
    figures = {name: getattr(values, name)(axis=0) for name in ("min", "max", "mean", "std")} | shares
    return {name: figure.tolist() for name, figure in figures.items()} | {"count": [len(values)]}


def _picture_statistics(shown: list[bytes]) -> dict[str, Any]:
    """Return each statistic of the pictures' colours, 0 to 1, in the shape (3, 1, 1)."""
    points = []
    for jpeg in shown[:: max(1, len(shown) // _SAMPLED_PICTURES)]:
        colors = np.asarray(decoded(jpeg))
        apart = -(-max(colors.shape) // _SAMPLED_PIXELS)
        points.append(colors[::apart, ::apart].reshape(-1, 3))
    found = _statistics(np.concatenate(points) / 255.0)
    found = {name: [[[value]] for value in values] for name, values in found.items()}
    return found | {"count": [len(points)]}


def _tasks(pyarrow: Any, task: str) -> Any:
    """Return the table of tasks. Their texts are the index of a pandas data frame, as the format's reader expects."""
    table = pyarrow.table({"task_index": np.zeros(1, dtype=np.int64), "task": [task]})
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


def _episode(number: int, first: int, end: int, task: str, stats: Mapping[str, Any]) -> dict[str, Any]:
    row: dict[str, Any] = {"episode_index": number, "tasks": [task], "length": end - first}
    row |= {"data/chunk_index": 0, "data/file_index": 0, "dataset_from_index": first, "dataset_to_index": end}
    row |= {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
    return row | {f"stats/{name}/{figure}": value for name, found in stats.items() for figure, value in found.items()}
