"""Exported files have the recording's content, in the layouts that other programs expect."""

import csv
import io
import itertools
import json
import shutil
import sys
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from common.episode import EpisodeMark
from common.errors import ConfigurationError
from common.protocol.codec import decode_view, encode
from common.protocol.messages import Header
from common.protocol.view_messages import VideoFrame
from common.recording.content import Content
from common.recording.mcap_file import RecordingFile
from common.recording.reading import Recording, open_recording
from common.recording.wire import HEADER, STATUS, VIEW, as_json, stamped
from feelahead.commands.recordings import export, plot
from feelahead.recordings.demonstrations import Picture, read_demonstrations, read_pictures
from feelahead.recordings.dictionary import column_of
from feelahead.recordings.lerobot import _of_one_size
from feelahead.recordings.playback import Seen, seen
from feelahead.recordings.replay_robot import replay_robot
from feelahead.recordings.tables import read_tables
from operator_side.controller.feel import SENSED_TRAVEL
from tests.feelahead.recordings.conftest import record_pictures
from tests.helpers.recordings.forms import FORMS, rewritten

pyarrow = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")

pytestmark = [pytest.mark.long, pytest.mark.xdist_group("recorded run")]


LEROBOT = "lerobot.datasets.lerobot_dataset"


@pytest.fixture(autouse=True)
def without_lerobot(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, LEROBOT, None)


def exported(run: Recording, kind: str, out: Path) -> Path:
    assert export([str(run.path), "--format", kind, "--out", str(out)]) == 0
    return out


def test_csv_has_a_file_for_each_topic_and_one_joined(run: Recording, tmp_path: Path) -> None:
    folder = exported(run, "csv", tmp_path / "csv")
    with (folder / "stiffness.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(list(run.messages(["/stiffness"])))
    first = json.loads(next(iter(run.messages(["/stiffness"]))).content)
    assert float(rows[0]["r2.fast_m.7"]) == first["r2"]["fast_m"][7]
    with (folder / "joined.csv").open(encoding="utf-8", newline="") as file:
        joined = list(csv.DictReader(file))
    times = np.array([float(row["recording_s"]) for row in joined])
    np.testing.assert_allclose(np.diff(times), 0.01, atol=1e-9)
    assert joined[-1]["stiffness.state"] == "armed"
    assert joined[0]["command.r2"] == ""  # Nothing was sent yet.


def test_every_exported_column_is_in_the_dictionary_beside_it(run: Recording, tmp_path: Path) -> None:
    folder = exported(run, "csv", tmp_path / "csv")
    beside = (folder / "columns.md").read_text(encoding="utf-8")
    for path in folder.glob("*.csv"):
        header = path.read_text(encoding="utf-8").splitlines()[0].split(",")
        assert not [name for name in header if column_of(path.stem, name).unit == "?"]
        assert not [name for name in header if any(other.startswith(f"{name}.") for other in header)]
        assert f"## {path.stem}\n" in beside
    assert "| `r2.fast_m.0` to `r2.fast_m.7` | m | the trigger |" in beside


def test_what_the_finger_meets_is_the_zone_under_it(run: Recording) -> None:
    joined = read_tables(run).joined()
    raw, meets = joined.numbers("controller.r2_raw"), joined.numbers("controller.r2_meets")
    zones = np.stack([joined.numbers(f"felt.r2.{zone}") for zone in range(10)], axis=1)
    stiff = np.flatnonzero(np.nan_to_num(meets) > 0)
    assert len(stiff) > 20
    under = [zones[row][int(10 * SENSED_TRAVEL * raw[row])] for row in stiff]
    # A row of `joined` may have zones that were written just after the finger was read.
    assert np.mean(meets[stiff] == under) > 0.9
    assert (joined.numbers("stiffness.r2.course_stiffness")[stiff] == 0.0).any()


def test_a_joined_row_never_knows_what_comes_later(run: Recording) -> None:
    tables = read_tables(run)
    joined, stiffness = tables.joined(), tables.table("stiffness")
    times, horizons = np.array(stiffness.times_s), list(joined.values("stiffness.horizon_m"))
    for row in range(0, len(joined.times_s), 37):
        before = np.flatnonzero(times <= joined.times_s[row] + 1e-9)
        expected = None if not len(before) else stiffness.rows[before[-1]]["horizon_m"]
        assert horizons[row] == expected


def test_parquet_has_the_same_numbers(run: Recording, tmp_path: Path) -> None:
    folder = exported(run, "parquet", tmp_path / "parquet")
    arm = parquet.read_table(folder / "arm.parquet")
    table = read_tables(run).table("arm")
    assert arm.column("position_rad.0").to_pylist() == [row["position_rad.0"] for row in table.rows]
    assert arm.num_rows > 1400


def test_lerobot_has_what_its_own_reader_asks_for(run: Recording, tmp_path: Path) -> None:
    folder = exported(run, "lerobot", tmp_path / "lerobot")
    info = json.loads((folder / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["total_episodes"]) == ("v3.0", 30, 1)
    place = {"chunk_index": 0, "file_index": 0}
    data = parquet.read_table(folder / info["data_path"].format(**place))
    assert data.num_rows == info["total_frames"] > 60
    assert set(data.column_names) == set(info["features"])
    for name, feature in info["features"].items():
        column = data.column(name)
        assert column.null_count == 0
        if feature["shape"] == [1]:
            assert str(column.type).replace("float", "float32") == feature["dtype"]
        else:
            assert column.type.list_size == feature["shape"][0] == len(feature["names"])
    assert data.column("index").to_pylist() == list(range(data.num_rows))
    np.testing.assert_allclose(np.diff(data.column("timestamp").to_numpy()), 1 / 30, atol=1e-4)
    episodes = parquet.read_table(folder / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert (episodes[0]["dataset_from_index"], episodes[0]["dataset_to_index"]) == (0, data.num_rows)
    assert episodes[0]["length"] == data.num_rows
    tasks = parquet.read_table(folder / "meta/tasks.parquet")
    assert tasks.column("task").to_pylist() == episodes[0]["tasks"]
    assert json.loads(tasks.schema.metadata[b"pandas"])["index_columns"] == ["task"]
    stats = json.loads((folder / "meta/stats.json").read_text())
    states = np.array(data.column("observation.state").to_pylist())
    np.testing.assert_allclose(stats["observation.state"]["mean"], states.mean(axis=0), rtol=1e-5, atol=1e-7)


def test_pictures_are_shown_as_they_were_sent(with_pictures: tuple[Recording, list[bytes]]) -> None:
    recording, payloads = with_pictures
    shown = list(seen(recording))
    assert [decode_view(one.content) for one in shown if one.kind == b"v"] == [decode_view(one) for one in payloads]
    assert shown[-1] == Seen(shown[-1].time_s, b"f", "/operator/facts", b'{"now_s":1.0}')
    # Each picture is in the file once.
    assert sum(len(one.content) for one in recording.messages(["/view"])) < 200 * len(payloads)


def test_lerobot_takes_pictures_as_they_are(with_pictures: tuple[Recording, list[bytes]], tmp_path: Path) -> None:
    recording, _ = with_pictures
    folder = exported(recording, "lerobot", tmp_path / "lerobot")
    data = parquet.read_table(folder / "data/chunk-000/file-000.parquet")
    first: Any = data.column("observation.images.overview")[0].as_py()
    assert first["bytes"] in [picture.jpeg for picture in read_pictures(recording)["overview"]]
    info = json.loads((folder / "meta/info.json").read_text())
    assert info["features"]["observation.images.overview"]["shape"] == [24, 32, 3]
    hints = json.loads(data.schema.metadata[b"huggingface"])["info"]["features"]
    assert hints["observation.images.overview"] == {"_type": "Image"}
    stats = json.loads((folder / "meta/stats.json").read_text())["observation.images.overview"]
    assert np.array(stats["mean"]).shape == (3, 1, 1)


def test_lerobot_says_how_old_pictures_are_and_how_many_there_are(
    with_pictures: tuple[Recording, list[bytes]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, payloads = with_pictures
    rows = {}
    for rate, arguments in ((10, []), (30, ["--fps", "30"])):
        out = tmp_path / str(rate)
        assert export([str(recording.path), "--format", "lerobot", "--out", str(out), *arguments]) == 0
        said = capsys.readouterr().out
        assert f"{rate} Hz; overview: " in said  # without --fps the pictures' own
        assert float(said.split(" distinct pictures, ")[1].split(" Hz")[0]) == pytest.approx(10.0, abs=0.2)
        assert json.loads((out / "meta/info.json").read_text())["fps"] == rate
        data = parquet.read_table(out / "data/chunk-000/file-000.parquet")
        ages_s = data.column("observation.picture_age_s").to_numpy()  # one camera: no list, as its hint says
        shown = [picture["bytes"] for picture in data.column("observation.images.overview").to_pylist()]
        assert len(set(shown)) == pytest.approx(len(payloads), abs=3)
        rows[rate] = shown, ages_s
    shown, ages_s = rows[30]
    # Captured 20 ms before it was sent, and shown until the next one: three frames.
    assert 0.02 - 1e-3 <= ages_s.min() < 0.04
    assert 0.08 < ages_s.max() < 0.13
    again = np.array([one == other for one, other in itertools.pairwise(shown)])
    np.testing.assert_allclose(np.diff(ages_s)[again], 1 / 30, atol=1e-4)
    assert (np.diff(ages_s)[~again] < 0.0).all()


def test_a_recording_with_the_former_name_of_s_is_exported_without_it(run: Recording, tmp_path: Path) -> None:
    path = tmp_path / "older.mcap"
    file = RecordingFile(path, 0.0)
    Content(file).write(0, HEADER + as_json({"side": "robot", **run.headers["robot"]}))
    for message in run.messages(("/stiffness", "/command", "/robot/inputs", "/operator/inputs")):
        time_s = 1e-9 * (message.log_ns - run.began_ns)
        file.write(message.topic, time_s, message.content.replace(b'"course_stiffness"', b'"stiffness"'))
    file.close()
    older = open_recording(path)
    assert "stiffness.r2.stiffness" in read_tables(older).joined().columns()
    folder = exported(older, "lerobot", tmp_path / "older")
    features = {*json.loads((folder / "meta/info.json").read_text())["features"]}
    assert "observation.course_stiffness" not in features
    assert {"observation.onset_distances", "observation.meets", "observation.felt"} <= features


def operators(path: Path, *frames: tuple[float, float | None, VideoFrame]) -> Recording:
    """Record frames at an operator side alone, each at its time, with the clock's offset that is known by then."""
    file = RecordingFile(path, 0.0)
    content = Content(file)
    content.write(0, HEADER + as_json({"side": "operator"}))
    for now_s, offset_s, frame in frames:
        content.write(0, STATUS + stamped(now_s) + as_json({"offset_s": offset_s}))
        content.write(0, VIEW + stamped(now_s) + encode(frame))
    file.close()
    return open_recording(path)


def test_an_operator_side_alone_knows_by_its_clock_offset_how_old_a_picture_is(tmp_path: Path) -> None:
    sent = []
    for number, offset_s in enumerate((None, 500.0)):
        now_s = 10.0 + number
        captured_s = now_s + 500.0 - 0.07  # on the robot side's clock; sent 20 ms later, 50 ms under way
        frame = VideoFrame(Header(1, number + 1, captured_s + 0.02), "overview", captured_s, 32, 24, b"jpeg")
        sent.append((now_s, offset_s, frame))
    found = read_pictures(operators(tmp_path / "operator.mcap", *sent))["overview"]
    # While the offset is unknown, only the time until it was sent counts.
    assert [one.time_s - one.captured_s for one in found] == pytest.approx([0.02, 0.07], abs=1e-6)


def test_pictures_that_arrived_at_one_moment_keep_their_own_messages(tmp_path: Path) -> None:
    sent = [
        VideoFrame(Header(1, number, 10.0), "overview", 10.0 - age_s, 32, 24, jpeg)
        for number, (age_s, jpeg) in enumerate(((0.07, b"first"), (0.03, b"second")), start=1)
    ]
    recording = operators(tmp_path / "operator.mcap", *((1.0, None, frame) for frame in sent))
    assert [decode_view(one.content) for one in seen(recording)] == sent
    found = read_pictures(recording)["overview"]
    assert [one.jpeg for one in found] == [b"first", b"second"]
    assert [one.time_s - one.captured_s for one in found] == pytest.approx([0.07, 0.03], abs=1e-6)


def test_lerobot_has_an_episode_for_each_that_was_marked_and_kept(
    run: Recording,
    with_pictures: tuple[Recording, list[bytes]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    whole = read_demonstrations(with_pictures[0], read_tables(with_pictures[0]))
    assert [*whole.episodes] == [(0, len(whole.times_s), None)]
    # Seconds after its first frame.
    marks: list[tuple[float, EpisodeMark]] = [(0.5, "start"), (1.5, "success"), (1.6, "failure"), (2.0, "start")]
    marks += [(2.4, "discard"), (2.5, "start"), (3.0, "failure"), (3.1, "reset"), (3.2, "start"), (3.6, "reset")]
    path = tmp_path / "marked.mcap"
    record_pictures(run, path, [(whole.times_s[0] + after_s, mark) for after_s, mark in (*marks, (3.8, "start"))])

    assert export([str(path), "--format", "lerobot", "--out", str(tmp_path / "out")]) == 0

    assert ": 4 episodes (1 success, 1 failure, 1 left out), " in capsys.readouterr().out
    episodes = parquet.read_table(tmp_path / "out/meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [one["success"] for one in episodes] == [True, False, None, None]
    assert [one["length"] for one in episodes[:3]] == pytest.approx([10, 5, 4], abs=1)
    data = parquet.read_table(tmp_path / "out/data/chunk-000/file-000.parquet")
    info = json.loads((tmp_path / "out/meta/info.json").read_text())
    assert (info["total_episodes"], info["splits"]) == (4, {"train": "0:4"})
    assert info["total_frames"] == data.num_rows == episodes[-1]["dataset_to_index"] < len(whole.times_s)
    states = np.array(data.column("observation.state").to_pylist())
    for number, one in enumerate(episodes):
        rows = slice(one["dataset_from_index"], one["dataset_to_index"])
        part = data.slice(rows.start, one["length"])
        assert set(part.column("episode_index").to_pylist()) == {number}
        assert part.column("frame_index").to_pylist() == list(range(one["length"]))
        assert part.column("timestamp")[0].as_py() == 0.0
        assert part.column("next.done").to_pylist() == [False] * (one["length"] - 1) + [True]
        assert part.column("next.success")[-1].as_py() is (one["success"] is True)
        np.testing.assert_allclose(one["stats/observation.state/mean"], states[rows].mean(axis=0), rtol=1e-5, atol=1e-7)


MARKS: tuple[tuple[float, EpisodeMark], ...] = ((3.0, "start"), (3.5, "success"), (4.0, "start"), (4.4, "failure"))


def marked(run: Recording, folder: Path) -> Recording:
    path = folder / "marked.mcap"
    record_pictures(run, path, (*MARKS, (5.0, "start")))
    return open_recording(path)


class PublishedWriter:
    """LeRobotDataset as published (0.4.4 to 0.6.1), as far as it is used; keeps what it is given."""

    made: "PublishedWriter"

    def __init__(self, asked: tuple[str, int, str], features: dict[str, Any], root: Path) -> None:
        self.asked, self.features, self.root = asked, features, root
        self.frames: list[dict[str, Any]] = []
        self.episodes: list[list[dict[str, Any]]] = []

    @classmethod
    def create(cls, repo_id: str, fps: int, features: dict[str, Any], root: Path, robot_type: str) -> "PublishedWriter":
        root.mkdir(parents=True, exist_ok=False)
        cls.made = cls((repo_id, fps, robot_type), features, root)
        return cls.made

    def add_frame(self, frame: dict[str, Any]) -> None:
        assert set(frame) == {*self.features, "task"}
        for name, feature in self.features.items():
            assert frame[name].shape == feature["shape"]  # tuples, or the published one refuses the frame
            assert str(frame[name].dtype) == ("uint8" if feature["dtype"] == "video" else feature["dtype"])
        self.frames.append(frame)

    def save_episode(self) -> None:
        self.episodes.append(self.frames)
        self.frames = []

    def finalize(self) -> None:
        folder = self.root / "meta/episodes/chunk-000"
        folder.mkdir(parents=True)
        numbers = pyarrow.table({"episode_index": list(range(len(self.episodes)))})
        parquet.write_table(numbers, folder / "file-000.parquet")


def test_lerobots_own_writer_gets_every_frame_of_each_episode(
    run: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = marked(run, tmp_path)
    plain = exported(recording, "lerobot", tmp_path / "plain")
    assert f"; written by feelahead, pictures as JPEG (import of {LEROBOT} halted" in capsys.readouterr().out
    module = SimpleNamespace(LeRobotDataset=PublishedWriter, CODEBASE_VERSION="v3.0")
    monkeypatch.setitem(sys.modules, LEROBOT, module)
    monkeypatch.setattr(metadata, "version", lambda _: "0.6.1")

    folder = exported(recording, "lerobot", tmp_path / "own")

    assert "; written by lerobot 0.6.1, pictures as video\n" in capsys.readouterr().out
    made = PublishedWriter.made
    data = parquet.read_table(plain / "data/chunk-000/file-000.parquet")
    info = json.loads((plain / "meta/info.json").read_text())
    assert made.asked == ("feelahead/marked", info["fps"], info["robot_type"])
    assert made.frames == []
    frames = [frame for episode in made.episodes for frame in episode]
    numbered = {"timestamp", "frame_index", "episode_index", "index", "task_index"}  # the writer's own
    assert set(info["features"]) == {*made.features} | numbered
    for name in made.features.keys() - {"observation.images.overview"}:
        expected = np.array(data.column(name).to_pylist())
        np.testing.assert_array_equal(np.squeeze([frame[name] for frame in frames]), np.squeeze(expected))
    assert [len(one) for one in made.episodes] == np.bincount(data.column("episode_index").to_numpy()).tolist()
    first = Image.open(io.BytesIO(data.column("observation.images.overview")[0].as_py()["bytes"]))
    np.testing.assert_array_equal(frames[0]["observation.images.overview"], np.asarray(first))
    episodes = parquet.read_table(folder / "meta/episodes/chunk-000/file-000.parquet")
    assert episodes.column("success").to_pylist() == [True, False, None]
    module.CODEBASE_VERSION = "v2.1"
    exported(recording, "lerobot", tmp_path / "old")
    assert "; written by feelahead, pictures as JPEG (lerobot writes v2.1)" in capsys.readouterr().out


@pytest.mark.filterwarnings("default")  # what a foreign package warns of
def test_lerobot_reads_what_its_own_writer_wrote(
    run: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(sys.modules, LEROBOT)
    library = pytest.importorskip(LEROBOT, exc_type=ImportError)
    folder = exported(marked(run, tmp_path), "lerobot", tmp_path / "own")
    assert "; written by lerobot " in capsys.readouterr().out
    read = library.LeRobotDataset("feelahead/marked", root=folder, video_backend="pyav")
    assert (read.meta.total_episodes, read.fps, len(read)) == (3, 10, read.meta.total_frames)
    assert [one["success"] for one in read.meta.episodes] == [True, False, None]
    ages_s = np.array(read.hf_dataset["observation.picture_age_s"])
    assert ((ages_s >= 0.0) & (ages_s < 0.2)).all()
    assert [*read.meta.video_keys] == ["observation.images.overview"]
    assert len(list((folder / "videos").rglob("*.mp4"))) == 1


@pytest.mark.parametrize("form", ["newest first, without chunks", "shuffled", "two channels for each topic"])
def test_a_recording_that_another_tool_wrote_again_gives_the_same_files(
    with_pictures: tuple[Recording, list[bytes]], tmp_path: Path, form: str
) -> None:
    recording, _ = with_pictures
    (tmp_path / "other").mkdir()
    other = tmp_path / "other" / recording.path.name
    other.write_bytes(rewritten(recording.path, **FORMS[form]))
    again = open_recording(other)

    def files(run: Recording, kind: str) -> dict[str, bytes]:
        folder = exported(run, kind, run.path.with_name(kind))
        return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}

    for kind in ("csv", "parquet", "lerobot"):
        assert files(again, kind) == files(recording, kind)
    assert list(seen(again)) == list(seen(recording))
    assert replay_robot(again).lines() == replay_robot(recording).lines()


def test_fps_is_for_lerobot_alone(run: Recording) -> None:
    with pytest.raises(ConfigurationError, match="--fps 20: valid with: --format lerobot"):
        export([str(run.path), "--fps", "20"])


def test_pictures_that_a_narrow_link_made_smaller_are_enlarged() -> None:
    made = []
    for size in ((64, 48), (32, 24), (64, 48)):
        content = io.BytesIO()
        Image.new("RGB", size, (10, 200, 30)).save(content, "JPEG")
        made.append(Picture(0.0, content.getvalue(), 0.0))

    alike, size = _of_one_size(made)

    assert size == (64, 48)
    assert alike[::2] == made[::2]
    with Image.open(io.BytesIO(alike[1].jpeg)) as enlarged:
        assert enlarged.size == size


@pytest.mark.parametrize("ending", [".png", ".svg"])
def test_a_page_is_drawn(run: Recording, tmp_path: Path, ending: str) -> None:
    pytest.importorskip("matplotlib")
    out = tmp_path / f"page{ending}"
    assert plot([str(run.path), "--out", str(out)]) == 0
    if ending == ".svg":
        assert "time since the recording began" in out.read_text(encoding="utf-8")
    else:
        with Image.open(out) as page:
            assert page.size == (1654, 2338)
            # Every panel has something in it: few rows of the page are blank.
            dark = (np.asarray(page.convert("L")) < 250).any(axis=1)
            assert dark.mean() > 0.8


def test_a_cut_run_is_exported_and_drawn(run: Recording, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    shutil.copy(run.path, cut)
    with cut.open("r+b") as file:
        file.truncate(run.path.stat().st_size // 3)
    assert export([str(cut), "--out", str(tmp_path / "csv")]) == 0
    assert plot([str(cut)]) == 0
    assert (tmp_path / "cut.png").exists()
