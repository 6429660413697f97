"""What each law puts on the zones over a recorded pull: covered or not, late or never, and as it is shipped."""

import math
from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from common.arrays import IntArray
from common.protocol.codec import decode, encode
from common.protocol.messages import Compensation, Header, MotionCommand, StiffnessUpdate
from feelahead.benchmarks.coverage.cells import LINKS
from feelahead.benchmarks.coverage.covered import lateness_s, stood
from feelahead.benchmarks.coverage.laws import Draw, make_law
from feelahead.lab.approaches.approach import Approach, PullRun
from feelahead.lab.approaches.frozen import frozen_scene
from feelahead.lab.approaches.laws import Law
from feelahead.lab.approaches.pulls import make_pull
from feelahead.lab.approaches.recording import RecordedApproach
from feelahead.lab.approaches.spoilt import Spoil
from operator_side.dualsense.reports.controller_state import SENSED_TRAVEL
from operator_side.dualsense.simulated.controller import SimulatedDualSense
from operator_side.feel.blindness import Blindness
from operator_side.feel.haptics import Haptics
from operator_side.feel.rendering import RenderingSettings
from operator_side.hands.travel_calibration import TravelCalibration, TriggerTravel
from robot_side.ahead.law import Situation
from robot_side.ahead.swept_law import SweptLaw
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.enlargement.distance import Uncertainty
from robot_side.enlargement.prediction_errors import BUILT_IN, load_prediction_errors
from robot_side.simulation.camera import CameraError
from robot_side.simulation.joint_reference import MotionLimits
from tests.feelahead.benchmarks.recorded_pulls import SEED, approaching, staged

pytestmark = [pytest.mark.long, pytest.mark.xdist_group("coverage")]


def covered(law: Law, spoil: Spoil = "nothing", link: str = "0 ms", ahead_m: float = 0.0) -> tuple[bool, int]:
    draw, _, last_s = approaching(link, ahead_m)
    judged = stood(make_law(law, 0.99, 0.02, spoil), draw, last_s)
    return judged.covered, judged.strength


def test_always_full_covers_and_none_does_not() -> None:
    assert covered("full") == (True, 8)
    assert covered("none") == (False, 0)


def lateness(law: Law, spoil: Spoil = "nothing") -> float:
    draw, touch_s, last_s = approaching()
    return lateness_s(make_law(law, 0.99, 0.02, spoil), draw, last_s, touch_s)


def test_lateness_is_none_in_time_grows_with_a_delay_and_is_without_end_on_the_other_trigger() -> None:
    assert lateness("full") == 0.0
    assert lateness("none") == math.inf
    assert lateness("swept") == 0.0
    assert lateness("swept", "swapped") == math.inf
    late_s = lateness("margin")
    # Between the moment at which it is due and the touch, 0.25 s and the braking later.
    assert 0.1 < late_s < 0.4
    assert lateness("margin", "delayed") in (pytest.approx(late_s + 0.1, abs=0.011), math.inf)
    assert lateness("margin", "swapped") == math.inf


@pytest.mark.parametrize("link", ["0 ms", "200 ms"])
@pytest.mark.parametrize("ahead_m", [0.0, -0.15])
def test_a_steady_pull_is_covered_by_either_reckoning_and_not_by_a_short_margin(link: str, ahead_m: float) -> None:
    assert covered("swept", link=link, ahead_m=ahead_m) == (True, 8)
    assert covered("swept_robot", link=link, ahead_m=ahead_m) == (True, 8)
    assert not covered("margin", link=link, ahead_m=ahead_m)[0]
    assert not covered("paper", link=link, ahead_m=ahead_m)[0]


def test_on_the_other_trigger_nothing_is_covered() -> None:
    assert covered("swept", "swapped") == (False, 0)


def strengths_before_contact(spoil: Spoil) -> IntArray:
    """100 ms apart, while the zones of R2 fill up one after the other."""
    draw, touch_s, _ = approaching()
    return make_law("swept", 0.99, spoil=spoil).felt(draw, np.array([touch_s - 0.4, touch_s - 0.3]))


def test_spoilt_laws_show() -> None:
    whole, delayed, swapped = (strengths_before_contact(spoil) for spoil in ("nothing", "delayed", "swapped"))
    # Farther zones are stiff earlier, on R2 alone.
    assert 0 < np.count_nonzero(whole[0, 1]) < np.count_nonzero(whole[1, 1]) < 10
    assert whole[1, 1].max() == 8
    assert whole[:, 0].max() == 0
    assert (delayed[1] == whole[0]).all()
    assert delayed[1, 1].sum() < whole[1, 1].sum()
    assert (swapped[:, 0] == whole[:, 1]).all()
    assert swapped[:, 1].max() == 0


def test_a_message_that_never_came_is_no_strength() -> None:
    draw, touch_s, _ = approaching()
    replay = copy(draw.replay)
    replay.record = replace(draw.replay.record, seen_sent_s=np.full_like(draw.replay.record.seen_sent_s, np.nan))
    assert make_law("swept", 0.99).felt(replace(draw, replay=replay), np.array([touch_s])).max() == 0


# The pipeline is what is shipped


def said(draw: Draw, row: int, compensation: Compensation) -> StiffnessUpdate:
    """What the robot side says in that row of the poses, with what it has heard by then."""
    replay, record = draw.replay, draw.replay.record
    now_s = float(record.pose_time_s[row])
    law = SweptLaw(
        Uncertainty(0.99, camera_sd_m=0.003, prediction=load_prediction_errors(BUILT_IN)),
        replay.encoder_sigma_rad,
        MotionLimits().of_joints(replay.joints),
        ToolMotionSettings(),
    )
    situation = Situation(
        pose=replay.estimated[row],
        joint_velocities_rad_s=record.joint_velocities_rad_s[row],
        objects=draw.objects,
        loop_age_s=float(record.loop_age_s[row]),
        loop_age_known=True,
        compensation=compensation,
        gap_m=None,
        held=None,
        lateral=(0.0, 0.0),
    )
    sensed, heard = law.sense(situation, now_s), record.tick_row(now_s)
    echo_sent_s, echo_held_s = float(record.applied_sent_s[heard]), now_s - float(record.applied_at_s[heard])
    return StiffnessUpdate(
        Header(epoch=1, sequence=1, sent_s=now_s, echo_sent_s=echo_sent_s, echo_held_s=echo_held_s),
        sensed.l2,
        sensed.r2,
        sensed.speed_m_s,
        sensed.horizon_m,
        rumble=sensed.rumble,
        state="armed",
    )


def having_sent(record: RecordedApproach, until_s: float, compensation: Compensation) -> Haptics:
    """The operator side's half, by a moment of the pull."""
    haptics = Haptics(
        RenderingSettings(), TravelCalibration(), enabled=True, swap_sides=False, compensation=compensation
    )
    for time_s, travel in zip(record.command_time_s.tolist(), record.command.tolist(), strict=True):
        if time_s <= until_s:
            header = Header(epoch=2, sequence=len(record.command), sent_s=time_s)
            haptics.commanded(MotionCommand(header, l2=0.0, r2=travel, run=True), time_s)
    return haptics


@pytest.mark.parametrize(
    ("law", "compensation", "link", "before_s"),
    [
        ("swept", "operator", "0 ms", 0.4),
        ("swept", "operator", "200 ms", 0.4),
        ("swept_robot", "robot", "0 ms", 0.4),
        ("swept_robot", "robot", "200 ms", 0.6),
    ],
)
def test_a_moment_of_it_is_what_the_operator_side_makes_of_that_message_and_its_own_commands(
    law: Law, compensation: Compensation, link: str, before_s: float
) -> None:
    draw, touch_s, _ = approaching(link)
    record = draw.replay.record
    tick = record.tick_row(touch_s - before_s)
    felt_s = float(record.tick_time_s[tick])
    message = decode(encode(said(draw, record.pose_row(float(record.seen_sent_s[tick])), compensation)))
    assert isinstance(message, StiffnessUpdate)
    haptics = having_sent(record, felt_s, compensation)
    pulled = TriggerTravel().travel(min(float(record.travel[tick, 1]) / SENSED_TRAVEL, 1.0))
    told = haptics.output_report(message, (0.0, pulled), Blindness(), felt_s)
    assert told is not None
    assert haptics.without_history == 0
    device = SimulatedDualSense()
    device.write(told, felt_s)

    felt = make_law(law, 0.99).felt(draw, np.array([felt_s]))[0]
    assert [list(effect.zone_strengths) for effect in device.effects] == felt.tolist()
    assert 0 < np.count_nonzero(felt[1]) < 10
    assert felt[1].max() == 8


@pytest.mark.parametrize("law", ["swept", "swept_robot", "paper", "margin"])
def test_over_a_whole_pull_it_is_what_both_sides_show_live(law: Law) -> None:
    seed, link, margin_m = SEED, LINKS["200 ms"], 0.05
    approach = Approach(frozen_scene("wall"), 0.0, strongest_n=0.0, link=link, law=law, seed=seed, margin_m=margin_m)
    run = PullRun(approach, make_pull("steady", seed))
    began_s = run.arm()
    for _ in run.go_on(began_s + 2.0):
        pass
    assert run.onset is not None
    trace = run.samples.trace()

    replay, posed, _ = staged("wall", link)
    # As the robot side of that seed perceives them (`build_robot_side`).
    _, camera_seed = np.random.SeedSequence(seed).generate_state(2)
    names = tuple(thing.name for thing in posed.scene.objects)
    camera = CameraError(names, (0.0, 0.0, 0.0), 0.003, 0.0, int(camera_seed))
    draw = Draw(replay, posed.perceived(camera.next_frame()), 0.003)
    felt = make_law(law, 0.99, margin_m).felt(draw, began_s + trace.time_s)[:, 1]

    # Its poses are 10 ms apart and its encoders draw other errors: by so much it may be off for a moment.
    differs = felt - trace.strengths
    assert np.count_nonzero(differs) < 0.04 * differs.size
    assert abs(differs.mean()) < 0.05
    assert trace.strengths.max() > 0
