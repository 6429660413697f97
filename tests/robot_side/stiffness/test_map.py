import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.objects.perceived import PerceivedObjects, Role
from robot_side.pairs.candidates import candidate_pairs
from robot_side.pairs.overlaps import Overlaps, evaluate
from robot_side.stiffness.map import Stiffness, StiffnessMap, StiffnessSettings
from tests.helpers.perceived_scenes import Scene, random_scene

_AHEAD = np.array([0.0, 0.0, 1.0])
_ENLARGEMENT_M = 0.02
_HAND_M = np.array([[x, y, 0.0] for x in (-0.04, 0.0, 0.04) for y in (-0.02, 0.02)])
_HAND_RADII_M = np.full(6, 0.02)
seeds = st.integers(0, 2**32 - 1)
repeatable = settings(derandomize=True, deadline=None, max_examples=40)


def _volumes(radii_m: FloatArray) -> FloatArray:
    result: FloatArray = 4.0 / 3.0 * math.pi * radii_m**3
    return result


def _overlaps(centers_m: FloatArray, radii_m: FloatArray, objects: PerceivedObjects) -> Overlaps:
    pairs = candidate_pairs(centers_m, radii_m, objects)
    return evaluate(centers_m, radii_m[pairs.sphere_index], objects, pairs)


def _triggers(count: int, advance: FloatArray = _AHEAD) -> dict[str, FloatArray]:
    return {"l2": np.tile(-advance, (count, 1)), "r2": np.tile(advance, (count, 1))}


class _Gripper:
    """A hand of spheres that is moved about, with a stiffness map that remembers."""

    def __init__(self, *, centers_m: FloatArray = _HAND_M, radii_m: FloatArray = _HAND_RADII_M, **changes: Any) -> None:
        self.centers_m, self.radii_m = centers_m, radii_m
        self.map = StiffnessMap(StiffnessSettings(**changes))
        self.now_s = 0.0

    def feel(self, objects: PerceivedObjects, at_m: FloatArray | None = None, **options: Any) -> Stiffness:
        """One update, long enough after the last one for the rate limit not to matter."""
        self.now_s += 10.0
        return self.update(objects, np.zeros(3) if at_m is None else at_m, self.now_s, **options)

    def update(self, objects: PerceivedObjects, at_m: FloatArray, now_s: float, **options: Any) -> Stiffness:
        enlarged = self.radii_m + _ENLARGEMENT_M
        return self.map.update(
            _overlaps(self.centers_m + at_m, enlarged, objects),
            objects.roles,
            _volumes(enlarged),
            _triggers(len(enlarged)),
            now_s,
            unenlarged_radii_m=self.radii_m,
            **options,
        )


def _wall(front_m: float, role: Role = Role.OBSTACLE) -> PerceivedObjects:
    """A block whose face lies square to the approach, `front_m` ahead of the hand's centres."""
    return Scene().add(role).box([0.0, 0.0, front_m + 1.0], [2.0, 2.0, 1.0]).objects()


def test_nothing_near_is_nothing_felt() -> None:
    felt = _Gripper().feel(_wall(0.1))
    assert (felt.l2, felt.r2, felt.rumble) == (0.0, 0.0, 0.0)
    assert len(felt.object_index) == 0
    assert felt.contributions.shape == (0, 3)
    assert felt.pairs_counted == 0


def test_an_obstacle_ahead_stiffens_the_advancing_trigger_only() -> None:
    felt = _Gripper(reference_fraction=1.0).feel(_wall(0.02))
    depth, radius = 0.02, 0.04
    cap = math.pi * depth**2 * (3.0 * radius - depth) / 3.0
    assert felt.r2 == pytest.approx(cap / (4.0 / 3.0 * math.pi * radius**3), rel=1e-9)
    assert felt.l2 == 0.0
    assert felt.rumble == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(felt.contributions, [[0.0, felt.r2, 0.0]], atol=1e-12)
    assert _Gripper(reference_fraction=0.05).feel(_wall(0.02)).r2 == 1.0


def test_total_mode_drops_the_direction() -> None:
    felt = _Gripper(mode="total", reference_fraction=1.0).feel(_wall(0.02))
    assert felt.l2 == felt.r2 == pytest.approx(_Gripper(reference_fraction=1.0).feel(_wall(0.02)).r2)
    assert felt.rumble == 0.0


@repeatable
@given(seed=seeds, mode=st.sampled_from(["directional", "total"]), fraction=st.sampled_from([1e-3, 0.05, 1.0]))
def test_outputs_stay_between_0_and_1(seed: int, mode: str, fraction: float) -> None:
    rng = np.random.default_rng(seed)
    objects = random_scene(rng, 4, 0.15)
    roles = tuple(rng.choice(np.array(Role), len(objects.roles)))
    gripper = _Gripper(mode=mode, reference_fraction=fraction)
    advance = rng.normal(size=(6, 3))
    advance /= np.linalg.norm(advance, axis=1, keepdims=True)
    radii = _HAND_RADII_M + _ENLARGEMENT_M
    for now_s in (0.0, 0.001, 1.0):
        felt = gripper.map.update(
            _overlaps(_HAND_M, radii, objects),
            roles,
            _volumes(radii),
            {"l2": -advance, "r2": advance},
            now_s,
            unenlarged_radii_m=_HAND_RADII_M,
        )
        assert all(0.0 <= value <= 1.0 for value in (felt.l2, felt.r2, felt.rumble))
        assert (felt.contributions >= 0.0).all()
        gripper.map.set_support_baseline()


@pytest.mark.parametrize("tilt_rad", [0.0, 0.5])
def test_stiffness_grows_all_the_way_into_a_plane(tilt_rad: float) -> None:
    advance = np.array([math.sin(tilt_rad), 0.0, math.cos(tilt_rad)])
    radii = _HAND_RADII_M + _ENLARGEMENT_M
    felt = []
    for front_m in np.linspace(0.05, -0.2, 400):
        overlaps = _overlaps(_HAND_M, radii, _wall(float(front_m)))
        chosen = StiffnessMap(StiffnessSettings(reference_fraction=1.0))
        felt.append(chosen.update(overlaps, [Role.OBSTACLE], _volumes(radii), _triggers(6, advance), 0.0))
    r2 = np.array([one.r2 for one in felt])
    assert (np.diff(r2) >= -1e-9).all()
    assert r2[0] == 0.0
    assert r2[-1] == pytest.approx(1.0)
    outside = np.linspace(0.05, -0.2, 400) > 0.1 * 0.04
    assert max(one.l2 for one, free in zip(felt, outside, strict=True) if free) == 0.0
    if tilt_rad == 0.0:
        assert max(one.l2 for one in felt) < 0.01


def _finger(count: int) -> FloatArray:
    """`count` centres along 60 mm."""
    along = np.linspace(-0.03, 0.03, count)
    return np.stack([np.zeros(count), along, np.zeros(count)], axis=1)


def _palm(count: int) -> FloatArray:
    """`count`² centres over 80 mm by 40 mm."""
    x, y = np.meshgrid(np.linspace(-0.04, 0.04, count), np.linspace(-0.02, 0.02, count))
    return np.stack([x.ravel(), y.ravel(), np.zeros(count * count)], axis=1)


_REFINEMENTS = {"finger": (_finger(5), _finger(10)), "palm": (_palm(4), _palm(6))}
_REFINEMENT_SCENES = {
    "wall": _wall(0.015),
    "wall deep": _wall(-0.01),
    "ball": Scene().add().sphere([0.01, 0.01, 0.06], 0.04).objects(),
    "slanted box": Scene()
    .add()
    .box([0.0, 0.0, 0.06], [0.05, 0.05, 0.03], np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]]))
    .objects(),
    "plate through it": Scene().add().box([0.0, 0.0, 0.01], [0.3, 0.3, 0.002]).objects(),
}


@pytest.mark.parametrize("gripper", list(_REFINEMENTS))
@pytest.mark.parametrize("scene", list(_REFINEMENT_SCENES))
def test_twice_the_spheres_feel_the_same_within_20_percent(gripper: str, scene: str) -> None:
    coarse, fine = (
        _Gripper(centers_m=centers, radii_m=np.full(len(centers), 0.015), reference_fraction=1.0).feel(
            _REFINEMENT_SCENES[scene]
        )
        for centers in _REFINEMENTS[gripper]
    )
    assert coarse.r2 > 0.01
    assert fine.r2 == pytest.approx(coarse.r2, rel=0.2)


def test_the_target_is_capped_and_an_obstacle_behind_it_still_shows() -> None:
    target = _wall(0.005, Role.TARGET)
    alone = _Gripper().feel(target)
    assert alone.detent_engaged
    assert alone.target_capped
    assert alone.r2 == pytest.approx(0.5)
    assert _Gripper(target_cap=0.3).feel(target).r2 == pytest.approx(0.3)
    scene = Scene().add(Role.TARGET).box([0.0, 0.0, 1.005], [2.0, 2.0, 1.0])
    with_obstacle = _Gripper().feel(scene.add().sphere([0.0, 0.0, 0.06], 0.03).objects())
    obstacle = _Gripper().feel(Scene().add().sphere([0.0, 0.0, 0.06], 0.03).objects())
    assert obstacle.r2 > 0.05
    assert with_obstacle.r2 == pytest.approx(alone.r2 + obstacle.r2)


def test_the_detent_is_one_step_at_predicted_contact() -> None:
    gripper = _Gripper(reference_fraction=1.0)
    felt = [gripper.feel(_wall(front, Role.TARGET)) for front in (0.0214, 0.0212, 0.0208, 0.0206)]
    assert [one.detent_engaged for one in felt] == [False, False, True, True]
    steps = np.diff([one.r2 for one in felt])
    assert steps[1] == pytest.approx(0.15 + steps[0], abs=0.005)
    assert steps[2] == pytest.approx(steps[0], abs=0.005)
    assert [one.l2 for one in felt] == [0.0] * 4
    # It lets go only when the target is clearly out of touch, and is there again at the next contact.
    fronts = (0.0225, 0.0235, 0.0225, 0.0205)
    engaged = [gripper.feel(_wall(front, Role.TARGET)).detent_engaged for front in fronts]
    assert engaged == [True, False, False, True]
    assert not gripper.feel(_wall(0.0205)).detent_engaged


def test_a_step_is_left_for_the_detent_however_large_the_overlap() -> None:
    gripper = _Gripper(reference_fraction=0.01)
    before = gripper.feel(_wall(0.0215, Role.TARGET))
    after = gripper.feel(_wall(0.0205, Role.TARGET))
    assert before.r2 == pytest.approx(0.35)
    assert after.r2 == pytest.approx(0.5)


def test_a_support_counts_only_beyond_its_value_at_arming() -> None:
    gripper = _Gripper(reference_fraction=1.0)
    resting = gripper.feel(_wall(0.025, Role.SUPPORT))
    assert resting.r2 > 0.02
    gripper.map.set_support_baseline()
    assert gripper.feel(_wall(0.025, Role.SUPPORT)).r2 == 0.0
    assert gripper.feel(_wall(0.030, Role.SUPPORT)).r2 == 0.0
    deeper = gripper.feel(_wall(0.015, Role.SUPPORT))
    full = _Gripper(reference_fraction=1.0).feel(_wall(0.015, Role.SUPPORT))
    assert deeper.r2 == pytest.approx(full.r2 - resting.r2)
    # An obstacle at the same place keeps its whole value.
    assert gripper.feel(_wall(0.025)).r2 == resting.r2


def test_the_baseline_belongs_to_one_support_and_one_trigger() -> None:
    front = Scene().add(Role.SUPPORT).box([0.0, 0.0, 1.02], [2.0, 2.0, 1.0])
    both = front.add(Role.SUPPORT).box([0.0, 0.0, -1.02], [2.0, 2.0, 1.0]).objects()
    gripper = _Gripper(reference_fraction=1.0)
    gripper.feel(both)
    gripper.map.set_support_baseline()
    moved = gripper.feel(both, np.array([0.0, 0.0, 0.01]))
    assert moved.r2 > 0.0
    assert moved.l2 == 0.0
    back = gripper.feel(both, np.array([0.0, 0.0, -0.01]))
    assert back.l2 == pytest.approx(moved.r2)
    assert back.r2 == 0.0


def test_a_baseline_needs_an_update() -> None:
    with pytest.raises(RuntimeError, match="set_support_baseline"):
        StiffnessMap(StiffnessSettings()).set_support_baseline()


def test_ignored_and_excluded_objects_contribute_nothing() -> None:
    assert _Gripper().feel(_wall(0.01, Role.IGNORED)).r2 == 0.0
    scene = Scene().add().sphere([0.0, 0.0, 0.05], 0.03).add(Role.TARGET).sphere([0.02, 0.0, 0.04], 0.03).objects()
    only_first = _Gripper(reference_fraction=1.0).feel(scene, excluded_objects={1})
    alone = Scene().add().sphere([0.0, 0.0, 0.05], 0.03).objects()
    assert only_first.r2 == _Gripper(reference_fraction=1.0).feel(alone).r2
    assert not only_first.detent_engaged
    assert only_first.object_index.tolist() == [0]
    assert _Gripper().feel(scene, excluded_objects=[0, 1]).r2 == 0.0


def test_danger_along_neither_trigger_raises_rumble() -> None:
    beside = Scene().add().box([1.0 + 0.06, 0.0, 0.0], [1.0, 2.0, 2.0]).objects()
    felt = _Gripper(reference_fraction=1.0).feel(beside)
    total = _Gripper(reference_fraction=1.0, mode="total").feel(beside).r2
    assert (felt.l2, felt.r2) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert felt.rumble == pytest.approx(total)
    assert felt.rumble > 0.01
    assert _Gripper(reference_fraction=1.0, rumble=False).feel(beside).rumble == 0.0
    behind = Scene().add().box([0.0, 0.0, -1.02], [2.0, 2.0, 1.0]).objects()
    felt = _Gripper(reference_fraction=1.0).feel(behind)
    assert felt.l2 > 0.0
    assert felt.rumble == pytest.approx(0.0, abs=1e-12)


def test_the_rate_limit_rises_in_20_ms_and_falls_in_40_ms() -> None:
    gripper = _Gripper()
    far, near = _wall(0.1), _wall(0.0)
    here = np.zeros(3)
    gripper.update(far, here, 1.0)
    rising = [gripper.update(near, here, 1.0 + 0.001 * tick) for tick in range(1, 26)]
    np.testing.assert_allclose([one.r2 for one in rising[:19]], 0.05 * np.arange(1, 20), atol=1e-9)
    assert rising[-1].r2 == 1.0
    assert rising[0].rate_limited
    assert not rising[-1].rate_limited
    falling = [gripper.update(far, here, 1.025 + 0.001 * tick) for tick in range(1, 45)]
    np.testing.assert_allclose([one.r2 for one in falling[:39]], 1.0 - 0.025 * np.arange(1, 40), atol=1e-9)
    assert falling[-1].r2 == 0.0
    with pytest.raises(ValueError, match="now_s"):
        gripper.update(far, here, 1.0)


def test_the_counters_say_what_was_counted() -> None:
    inside = _Gripper().feel(_wall(-0.01))
    assert inside.pairs_counted == inside.pairs_inside == 6
    assert inside.pairs_blended == 0
    swallowed = Scene().add().sphere([0.04, 0.02, 0.01], 0.004).objects()
    felt = _Gripper().feel(swallowed)
    assert felt.pairs_blended >= 1


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"l2": np.zeros((5, 3))}, "l2"),
        ({"r2": np.full((6, 3), 0.9)}, "trigger_directions"),
        ({"r2": np.full((6, 3), np.nan)}, "trigger_directions"),
    ],
)
def test_bad_directions_are_named(changes: dict[str, FloatArray], named: str) -> None:
    radii = _HAND_RADII_M + _ENLARGEMENT_M
    overlaps = _overlaps(_HAND_M, radii, _wall(0.01))
    with pytest.raises(ValueError, match=named):
        StiffnessMap(StiffnessSettings()).update(
            overlaps, [Role.OBSTACLE], _volumes(radii), {**_triggers(6), **changes}, 0.0
        )


@pytest.mark.parametrize("volume", [-1.0, math.nan, 0.0])
def test_bad_volumes_are_named(volume: float) -> None:
    overlaps = _overlaps(_HAND_M, _HAND_RADII_M, _wall(0.01))
    with pytest.raises(ValueError, match="volume"):
        StiffnessMap(StiffnessSettings()).update(overlaps, [Role.OBSTACLE], np.full(6, volume), _triggers(6), 0.0)


@pytest.mark.parametrize(
    "bad",
    [
        {"mode": "both"},
        {"reference_fraction": 0.0},
        {"target_cap": 1.5},
        {"detent_step": 0.6},
        {"rise_per_s": 0.0},
        {"fall_per_s": math.nan},
        {"detent_engage_m": 0.01},
    ],
)
def test_bad_settings_are_named(bad: dict[str, Any]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(bad))):
        StiffnessSettings(**bad)
