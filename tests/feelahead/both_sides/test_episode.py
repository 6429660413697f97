"""Episodes as a script of somebody's runs them, and what a wrong argument is told."""

import re
import sys
import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import feelahead
from common.errors import ConfigurationError, FeelaheadError
from common.recording.reading import open_recording
from common.roles import Role
from feelahead import Episode, FingerInput, LawInputs, LinkProfile, Seen, Sensed, Situation
from feelahead.both_sides.episode import _say_compiling
from feelahead.recordings.replay_robot import replay_robot
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from robot_side.compiled import warm_up
from robot_side.settings import CameraSettings
from robot_side.surroundings.perceived import ObjectSource, PerceivedObjects
from tests.helpers.repository import DATA, ROOT
from tests.robot_side.compiled.fresh_kernels import fresh_kernels

WALL: dict[str, Any] = {"scene": "wall", "link": "delay 100ms", "seed": 3}


class Nearest:
    """Law: the stiffer the nearer, at any speed."""

    def __init__(self, inputs: LawInputs) -> None:
        self.inputs = inputs

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        del now_s
        return self.inputs.sensed(situation, l2=0.0, r2=1.0 - self.inputs.nearest_m(situation, 0.08) / 0.08)


class Retreats:
    """Person who pulls R2 until it resists, draws back, and has finished."""

    felt_s: float | None = None

    def act(self, seen: Seen) -> FingerInput | None:
        if self.felt_s is None:
            if seen.strengths[1] < 4:
                return FingerInput(r2_n=2.0)
            self.felt_s = seen.since_s
        return FingerInput(l2_n=2.0) if seen.since_s < self.felt_s + 0.5 else None


class Failing:
    """Law, person and perception with a fault: they fail, or return something else."""

    def __init__(self, returns: object = None) -> None:
        self.returns = returns

    def sense(self, situation: Situation, now_s: float) -> object:
        del situation, now_s
        return 1 / 0 if self.returns is None else self.returns

    def perceive(self, now_s: float) -> object:
        del now_s
        return 1 / 0 if self.returns is None else self.returns

    def set_role(self, name: str, role: Role) -> None: ...

    def act(self, seen: Seen) -> object:
        del seen
        return 1 / 0 if self.returns is None else self.returns


class Lagging:
    """Perception that shows what was half a second ago."""

    def __init__(self, camera: ObjectSource) -> None:
        self.camera, self.frames = camera, list[tuple[float, PerceivedObjects]]()
        self.set_role = camera.set_role

    def perceive(self, now_s: float) -> PerceivedObjects:
        self.frames.append((now_s, self.camera.perceive(now_s)))
        while len(self.frames) > 1 and self.frames[1][0] <= now_s - 0.5:
            self.frames.pop(0)
        return self.frames[0][1]


def test_a_finger_of_two_newtons_stops_with_haptics_and_hits_without() -> None:
    felt, blind = (Episode(**WALL, haptics=haptics).arm().step(5.0, r2_n=2.0) for haptics in (True, False))
    assert felt.contacts == ()
    assert felt.history.true_gap_m.min() > 0.005
    assert felt.history.strength[:, 1].max() == 8.0
    (contact,) = blind.contacts
    assert contact.thing == "wall"
    assert contact.speed_m_s == pytest.approx(0.12, abs=0.01)
    assert np.nanmax(blind.history.contact_speed_m_s) == contact.speed_m_s


def test_the_history_has_one_time_base_and_names_its_axes() -> None:
    episode = Episode(**WALL).arm().step(0.5, r2_n=2.0, left_stick=(0.3, 0.0))
    history = episode.history
    assert np.diff(history.time_s) == pytest.approx(0.008)
    assert {len(getattr(history, field.name)) for field in fields(history)} == {len(history.time_s)}
    assert not history.armed[0]
    assert history.armed[-1]
    assert history.tool_position_m[-1] == pytest.approx(episode.tool_position_m, abs=2e-3)
    assert history.loop_age_s[-1] == pytest.approx(0.21, abs=0.03)
    frame = history.to_pandas()
    assert list(frame.columns[:5]) == ["time_s", "armed", "tool_position_m_x", "tool_position_m_y", "tool_position_m_z"]
    assert frame["strengths_r2_10"].to_numpy() == pytest.approx(history.strengths[:, 1, 9])
    assert frame["onset_distances_m_l2_1"].to_numpy() == pytest.approx(history.onset_distances_m[:, 0, 0])


def test_the_same_seed_gives_the_same_numbers_again_and_another_seed_others() -> None:
    episode = Episode(**WALL)
    runs = [episode.reset(seed).arm().step(1.0, r2_n=2.0).history.onset_distances_m[-1] for seed in (3, 3, 4)]
    assert np.array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], runs[2])


def test_a_law_a_person_a_perception_and_an_arm_of_somebodys_own_are_used() -> None:
    made: list[Any] = []

    def arm(simulated: Any) -> Any:
        made.append(simulated)
        return simulated

    episode = Episode(**WALL, law=Nearest, person=Retreats, perception=Lagging, arm=arm).run(seconds=20.0)
    assert episode.done
    assert episode.contacts == ()
    history = episode.history
    assert set(np.unique(history.strength[:, 1])) >= {1.0, 2.0, 3.0}  # not at once, as with swept
    assert history.tool_position_m[-1, 0] < history.tool_position_m[:, 0].max() - 0.02
    assert len(made) == 1


def test_a_link_is_given_in_words_as_a_profile_or_as_one_for_each_direction() -> None:
    profile = LinkProfile(delay_s=0.1)
    links = "delay 100ms", profile, {"to_robot": profile, "to_operator": profile}
    ends = [Episode(link=link, seed=3).arm().step(1.0, r2_n=2.0).tool_position_m for link in links]
    assert ends[0] == pytest.approx(ends[1], abs=0.0)
    assert ends[0] == pytest.approx(ends[2], abs=0.0)


def test_the_scripted_person_does_the_task_and_says_that_it_is_done() -> None:
    episode = Episode(person="grasping").run()
    assert episode.done
    assert episode.summary()["task"]["lifted_mm"] > 50.0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"law": "swep"}, "law 'swep': there is no such law; valid: swept, paper"),
        ({"law": Path("none.py")}, "law none.py: there is no such file; valid: a Python file that defines law"),
        ({"law": 3}, "law int: is of type int; valid: a class or function that takes a LawInputs"),
        ({"law": lambda inputs: inputs}, "LawInputs lacks sense(situation, now_s)"),
        ({"law": lambda inputs: inputs.none}, "cannot be made from the law's inputs: AttributeError"),
        ({"scene": "wal"}, 'scene = "wal"; valid: "table" or "wall" or "slot" or "shelf"'),
        ({"model": "none.xml", "site": "tool"}, "none.xml: there is no such file"),
        ({"model": DATA / "wall.xml"}, "Episode: model is given without site; valid: both, or neither"),
        ({"gravity": 1.0, "bind": ""}, "Episode: bind, gravity: no such setting; valid: arm, arm_fastest_m_s, "),
        (
            {"probabilty": 0.9},
            "Episode: probabilty: no such setting (perhaps probability); valid: arm, arm_fastest_m_s, ",
        ),
        ({"link": "delay x"}, "delay: 'x' is no duration"),
        ({"link": 0.1}, "Episode: link is of type float; valid: netem's words, a LinkProfile, or these by name"),
        ({"probability": 1.0}, "probability"),
        ({"person": object()}, "person: object lacks act(seen)"),
        ({"perception": 3}, "perception: is of type int; valid: a function that takes the simulated one"),
        ({"arm": lambda _: None}, "arm: NoneType lacks command(joint_velocity_rad_s, valid_until_s)"),
    ],
)
def test_a_wrong_argument_is_refused_at_once_with_what_is_valid(given: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigurationError) as refused:
        Episode(**given)
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"perception": Failing}, r"^perception Failing: perceive returned MujocoCamera; valid: a PerceivedObjects"),
        ({"perception": lambda _: Failing()}, r"^perception Failing: ZeroDivisionError, test_episode.py line \d+: "),
        (
            {"law": lambda _: Failing()},
            r"^law <lambda>: sense: ZeroDivisionError, test_episode.py line \d+: division by zero$",
        ),
        (
            {"law": lambda _: Failing(3)},
            r"^law <lambda>: sense returned int; valid: a Sensed",
        ),
        (
            {"person": Failing},
            r"^person Failing: ZeroDivisionError, test_episode.py line \d+: division by zero",
        ),
        ({"person": lambda: Failing(3)}, r"^person Failing: act returned int; valid: a FingerInput"),
    ],
)
def test_a_part_that_fails_ends_the_run_with_its_name_and_line(given: dict[str, Any], said: str) -> None:
    with pytest.raises(FeelaheadError, match=said):
        Episode(**WALL, **given).step(3.0)


def test_settings_of_a_side_may_be_given_as_texts_tables_or_records() -> None:
    for camera in ({"sd_m": 0.001}, CameraSettings(sd_m=0.001)):
        assert Episode(scene="wall", camera=camera, sampled=False).settings.camera.sd_m == 0.001


def test_what_cannot_be_is_said_when_it_is_asked() -> None:
    episode = Episode(sampled=False, link="delay 2s")
    with pytest.raises(FeelaheadError, match="was not armed within 30 s over --link 'delay 2s'"):
        episode.arm()
    with pytest.raises(ValueError, match="not sampled; valid: Episode"):
        _ = episode.history
    with pytest.raises(ValueError, match="no history yet; valid: after arm"):
        _ = Episode().history
    with pytest.raises(ValueError, match="seconds = nan; valid: a number from 0 on"):
        episode.step(float("nan"))
    with pytest.raises(ValueError, match="valid: before it begins"):
        episode.record("late.mcap")


def test_an_episode_is_recorded_as_the_sides_record_it(tmp_path: Path) -> None:
    with Episode(**WALL).record(tmp_path / "run.mcap") as episode:
        episode.arm().step(1.0, r2_n=2.0)
    recording = open_recording(tmp_path / "run.mcap")
    assert recording.whole
    assert {"robot", "operator"} == recording.headers.keys()
    assert len(list(recording.messages(("/stiffness",)))) > 50


def test_the_face_has_few_names_each_of_which_is_there() -> None:
    assert len(feelahead.__all__) <= 15
    for name in feelahead.__all__:
        assert getattr(feelahead, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'Epsiode'; valid: Arm, "):
        _ = feelahead.Epsiode


class Slow:
    """Arm that has only what an arm must have."""

    def __init__(self, arm: Any) -> None:
        self.command_gripper, self.state, self._command = arm.command_gripper, arm.state, arm.command

    def command(self, joint_velocity_rad_s: Any, valid_until_s: float) -> None:
        self._command(0.5 * joint_velocity_rad_s, valid_until_s)


class Broken(Slow):
    def command(self, joint_velocity_rad_s: Any, valid_until_s: float) -> None:
        raise KeyError(joint_velocity_rad_s, valid_until_s)


def test_an_arm_of_ones_own_needs_three_methods_and_its_faults_are_told() -> None:
    ways = [Episode(scene="wall", arm=arm).arm().step(0.6, r2_n=2.0).tool_position_m[0] for arm in (None, Slow)]
    home = Episode(scene="wall").tool_position_m[0]
    assert ways[1] - home == pytest.approx(0.5 * (ways[0] - home), rel=0.15)
    with pytest.raises(FeelaheadError, match=r"^arm Broken: KeyError, test_episode.py line \d+: "):
        Episode(scene="wall", arm=Broken).arm().step(0.5, r2_n=2.0)


def test_a_released_trigger_meets_nothing() -> None:
    history = Episode(**WALL).arm().step(3.0, r2_n=2.0).step(2.0).history
    assert history.strength[:, 1].max() == 8.0
    assert tuple(history.strength[-1]) == (0.0, 0.0)


def test_arming_late_is_no_fault_and_hands_that_wait_are_named() -> None:
    class Waits:
        def act(self, seen: Seen) -> FingerInput | None:
            return None if seen.since_s > 1.0 else FingerInput()

    episode = Episode(**WALL).step(40.0)
    assert episode.arm().armed
    assert episode.run(Waits()).arm().done


@pytest.mark.parametrize("given", [{"law": Nearest}, {"link": LinkProfile(delay_s=0.05)}])
def test_a_recording_says_what_was_given_as_an_object_and_keeps_its_end(given: dict[str, Any], tmp_path: Path) -> None:
    with Episode(scene="wall", **given).record(tmp_path / "run.mcap") as episode:
        episode.arm().step(0.123)
    recording = open_recording(tmp_path / "run.mcap")
    header = recording.headers["robot"]
    if "law" in given:
        assert header["settings"]["law"].startswith("object:")
        with pytest.raises(ConfigurationError, match="which replay does not run"):
            replay_robot(recording)
    else:
        assert "delay_s=0.05" in header["given"]["link"]
    assert recording.length_s() == pytest.approx(episode.time_s, abs=0.01)


def test_a_second_recording_a_bad_seed_and_a_given_device_are_refused_and_nothing_is_lost(tmp_path: Path) -> None:
    with Episode(**WALL).record(tmp_path / "run.mcap") as episode:
        with pytest.raises(ValueError, match="a recording has begun already"):
            episode.record(tmp_path / "again.mcap")
        episode.arm()
    assert open_recording(tmp_path / "run.mcap").length_s() > 1.0
    with pytest.raises(ConfigurationError, match="seed"):
        episode.reset("three")  # type: ignore[arg-type]
    assert episode.reset(np.int64(4)).settings.seed == 4  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="a controller that was given cannot begin anew"):
        Episode(device=SimulatedDualSense()).reset()


@pytest.mark.parametrize(
    ("does", "said"),
    [
        (lambda episode: episode.step(1.0, r2_n=float("nan")), "r2_n = nan; valid: a force of 0 N or more"),
        (lambda episode: episode.step(1.0, left_stick=(3.0, 0.0)), "left_stick = (3.0, 0.0); valid: right and up"),
        (lambda episode: episode.step(1.0, buttons="cross"), "valid: a set of Button"),
        (lambda episode: episode.run(seconds=-1.0), "seconds = -1.0; valid: a number from 0 on"),
        (lambda episode: episode.run(), "run: there is no person; valid: run(person), or step(seconds"),
        (lambda episode: episode.picture("side"), "view = 'side'; valid: overview, first_person"),
        (lambda _: Episode(link={"to_robto": LinkProfile()}), "link: to_robto: no such direction; valid: to_robot,"),
    ],
)
def test_what_cannot_be_done_is_refused_before_it_is(does: Any, said: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011
        does(Episode(scene="wall"))
    assert said in str(refused.value)


def test_compiling_is_said_once_and_not_where_the_kernels_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Episode(**WALL)  # its own kernels are ready from here on
    monkeypatch.setattr(warm_up, "imported_kernels", fresh_kernels)
    monkeypatch.setattr(warm_up, "_NOTEWORTHY_S", 0.0)
    said = []
    for folder, anew in (("a", True), ("b", False), ("a", True)):
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / folder))
        if anew:
            _say_compiling.cache_clear()
        capsys.readouterr()
        Episode(**WALL)
        said.append(capsys.readouterr().err)
    assert said == [f"feelahead: {warm_up.COMPILING}\n", "", ""]


def test_an_extra_that_is_missing_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    episode = Episode(**WALL)
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(ConfigurationError, match=r"foxglove is not installed; .*\[record\]"):
        episode.record(tmp_path / "run.mcap")
    monkeypatch.setitem(sys.modules, "pandas", None)
    history = episode.step(0.1).history
    with pytest.raises(ConfigurationError, match=r"^to_pandas: pandas is not installed; .*\[study\]"):
        history.to_pandas()


def test_the_version_is_that_of_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert feelahead.__version__ == project["version"]


def test_the_guides_names_are_there() -> None:
    seen: dict[str, Any] = {}

    class Watching(Nearest):
        """Law that keeps what it is given."""

        def sense(self, situation: Situation, now_s: float) -> Sensed:
            seen.update(inputs=self.inputs, situation=situation)
            return super().sense(situation, now_s)

    episode = Episode(scene="wall", seed=3, link="delay 1ms", haptics=False, law=Watching).arm().step(4.0, r2_n=2.0)
    seen |= {"contact": episode.contacts[0], "summary": episode.summary()}
    _, _, guide = (ROOT / "docs" / "python.md").read_text(encoding="utf-8").partition("\n## Names\n")
    names = re.findall(rf"`((?:{'|'.join(seen)})\.[\w.]+)`", guide)
    assert len(names) > 30
    for name in names:
        found: Any = seen
        for part in name.split("."):
            found = found[part] if isinstance(found, dict) else getattr(found, part)
