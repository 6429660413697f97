"""Export of a recording as one episode of a LeRobot dataset, v3.0, for learning from demonstrations.

data/chunk-000/file-000.parquet            one row for each frame, pictures as encoded bytes
meta/info.json, stats.json, tasks.parquet
meta/episodes/chunk-000/file-000.parquet   one row for each episode
"""

import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from common.arrays import FloatArray
from common.errors import ConfigurationError
from common.protocol.view_messages import VIEW_NAMES
from common.recording.images import read_image
from common.recording.reading import Recording
from feelahead.recordings.tables import Table, Tables

FRAMES_HZ: Final = 30
_VERSION: Final = "v3.0"
_FILE: Final = "chunk-{chunk_index:03d}/file-{file_index:03d}"
_TASK: Final = "reach the target, grasp it, lift it and set it down"
_STRENGTHS: Final = 8
_ZONES: Final = 10
_SAMPLED_PICTURES: Final = 20
"""About the maximum number of pictures from which the statistics are computed."""
_ENLARGED_QUALITY: Final = 90
_ACTION: Final = {
    "l2": "command.l2",
    "r2": "command.r2",
    "lateral_right": "command.lateral.0",
    "lateral_up": "command.lateral.1",
    "turning_right": "command.turning.0",
    "turning_up": "command.turning.1",
    "gripper": "command.gripper",
}


class Picture(NamedTuple):
    """One picture of a camera."""

    time_s: float
    """Time since the recording began"""
    jpeg: bytes


def export_lerobot(recording: Recording, tables: Tables, folder: Path) -> int:
    """Write the dataset into `folder`; return the number of frames.

    Raises ConfigurationError if the recording has no states of the arm or no commands.
    """
    import pyarrow  # noqa: PLC0415
    from pyarrow import parquet  # noqa: PLC0415

    joined = tables.joined(FRAMES_HZ)
    seen = {view: pictures(recording, view) for view in VIEW_NAMES}
    vectors = _vectors(joined)
    first = _first_whole_row(vectors, {view: found for view, found in seen.items() if found}, joined)
    times_s = np.array(joined.times_s[first:])
    count = len(times_s)
    features: dict[str, Any] = {}
    columns: dict[str, Any] = {}
    stats: dict[str, Any] = {}
    for name, parts in vectors.items():
        values = np.stack([joined.numbers(column)[first:] for column in parts.values()], axis=1).astype(np.float32)
        # The format allows no gaps: a column with gaps, such as the stiffness, repeats its last value.
        values = _held(values)
        features[name] = {"dtype": "float32", "shape": [len(parts)], "names": list(parts)}
        columns[name] = pyarrow.FixedSizeListArray.from_arrays(pyarrow.array(values.ravel()), len(parts))
        stats[name] = _statistics(values.astype(np.float64))
    for view, found in seen.items():
        if found:
            shown, (width, height) = _of_one_size(_newest(found, times_s))
            key = f"observation.images.{view}"
            features[key] = {"dtype": "image", "shape": [height, width, 3], "names": ["height", "width", "channels"]}
            columns[key] = pyarrow.array(
                [{"bytes": picture.jpeg, "path": f"frame-{row:06d}.jpg"} for row, picture in enumerate(shown)],
                type=pyarrow.struct([("bytes", pyarrow.binary()), ("path", pyarrow.string())]),
            )
            stats[key] = _picture_statistics(shown)
    counters: dict[str, Any] = {
        "timestamp": (np.arange(count) / FRAMES_HZ).astype(np.float32),
        "frame_index": np.arange(count, dtype=np.int64),
        "episode_index": np.zeros(count, dtype=np.int64),
        "index": np.arange(count, dtype=np.int64),
        "task_index": np.zeros(count, dtype=np.int64),
    }
    for name, values in counters.items():
        features[name] = {"dtype": str(values.dtype), "shape": [1], "names": None}
        columns[name] = pyarrow.array(values)
        stats[name] = _statistics(values[:, None].astype(np.float64))
    table = pyarrow.table(columns)
    hints = {"info": {"features": {name: _hint(feature) for name, feature in features.items()}}}
    table = table.replace_schema_metadata({"huggingface": json.dumps(hints)})
    parquet.write_table(table, _made(folder / "data" / _first_file()), compression="snappy")
    parquet.write_table(_tasks(pyarrow), _made(folder / "meta" / "tasks.parquet"))
    parquet.write_table(pyarrow.table(_episode(count, stats)), _made(folder / "meta" / "episodes" / _first_file()))
    (folder / "meta" / "info.json").write_text(json.dumps(_info(recording, features, count), indent=4) + "\n")
    (folder / "meta" / "stats.json").write_text(json.dumps(stats, indent=4) + "\n")
    return count


def pictures(recording: Recording, view: str) -> list[Picture]:
    """Return all pictures of the camera `view`, in order of time."""
    first_ns = recording.began_ns()
    messages = recording.messages([f"/camera/{view}"])
    return [Picture(1e-9 * (message.log_ns - first_ns), read_image(message.content).jpeg) for message in messages]


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


def _vectors(joined: Table) -> dict[str, dict[str, str]]:
    """Return for each feature of the dataset its parts, and the joined table's column for each part."""
    joints = [column for column in joined.columns() if column.startswith("arm.position_rad.")]
    if not joints or "command.r2" not in joined.columns():
        raise ConfigurationError("--format lerobot: arm states or commands are missing; valid: both sides recorded")
    state = {f"joint_{index}_rad": column for index, column in enumerate(joints)}
    velocity = {f"joint_{index}_rad_s": f"arm.velocity_rad_s.{index}" for index in range(len(joints))}
    vectors = {
        "observation.state": state | {"gripper_opening_m": "arm.gripper_opening_m"},
        "observation.velocity": velocity,
        "action": _ACTION,
    }
    if "stiffness.r2.stiffness" in joined.columns():
        vectors["observation.stiffness"] = {f"{side}_stiffness": f"stiffness.{side}.stiffness" for side in ("l2", "r2")}
        vectors["observation.onset_distances"] = {
            f"{side}_{kind}_{strength + 1}_m": f"stiffness.{side}.{kind}_m.{strength}"
            for side in ("l2", "r2")
            for kind in ("fast", "slow")
            for strength in range(_STRENGTHS)
        }
    if "felt.r2.0" in joined.columns():
        vectors["observation.felt"] = {
            f"{side}_zone_{zone}": f"felt.{side}.{zone}" for side in ("l2", "r2") for zone in range(_ZONES)
        }
    return vectors


def _first_whole_row(vectors: Mapping[str, Mapping[str, str]], seen: Mapping[str, list[Picture]], joined: Table) -> int:
    """Return the first row from which every required column has a value and every camera a picture."""
    needed = [*vectors["observation.state"].values(), *vectors["action"].values()]
    if "observation.stiffness" in vectors:
        needed += vectors["observation.stiffness"].values()
    begins = [int(np.argmax(np.isfinite(joined.numbers(column)))) for column in needed]
    begins += [int(np.searchsorted(np.array(joined.times_s), found[0].time_s)) for found in seen.values()]
    first = max(begins)
    if first >= len(joined.times_s):
        raise ConfigurationError("--format lerobot: the recording ends before every required value has come")
    return first


def _held(values: Any) -> Any:
    """Fill each gap with the last value before it, or with 0 if there is none."""
    filled = values.copy()
    rows = np.where(np.isfinite(filled), np.arange(len(filled))[:, None], -1)
    newest = np.maximum.accumulate(rows, axis=0)
    filled = np.take_along_axis(filled, np.maximum(newest, 0), axis=0)
    return np.where(newest >= 0, filled, 0.0).astype(np.float32)


def _newest(found: list[Picture], times_s: FloatArray) -> list[Picture]:
    rows = np.searchsorted([picture.time_s for picture in found], times_s + 1e-9, side="right") - 1
    return [found[max(0, row)] for row in rows]


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


def _episode(count: int, stats: Mapping[str, Any]) -> dict[str, list[Any]]:
    row: dict[str, Any] = {"episode_index": 0, "tasks": [_TASK], "length": count}
    row |= {"data/chunk_index": 0, "data/file_index": 0, "dataset_from_index": 0, "dataset_to_index": count}
    row |= {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
    row |= {f"stats/{name}/{figure}": value for name, found in stats.items() for figure, value in found.items()}
    return {name: [value] for name, value in row.items()}


def _info(recording: Recording, features: Mapping[str, Any], count: int) -> dict[str, Any]:
    settings = recording.headers.get("robot", {}).get("settings", {})
    return {
        "codebase_version": _VERSION,
        "robot_type": Path(settings["model"]).stem if settings.get("model") else "feelahead",
        "total_episodes": 1,
        "total_frames": count,
        "total_tasks": 1,
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 500,
        "fps": FRAMES_HZ,
        "splits": {"train": "0:1"},
        "data_path": f"data/{_FILE}.parquet",
        "video_path": None,
        "features": features,
    }


def _first_file() -> str:
    return _FILE.format(chunk_index=0, file_index=0) + ".parquet"


def _made(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path
