import dataclasses
import importlib
import inspect
import math
from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta

from common.emulation.clauses import Chance, Outage, Rate
from common.emulation.loss import GilbertElliott, RandomLoss
from common.limits import Finite, Limited, Share, check_limits, check_value
from operator_side.dualsense.reports.feature_report import Firmware


@dataclass(frozen=True)
class _Record:
    gap_s: Annotated[float, Meta(gt=0.0, lt=60.0)] = 1.0
    share: Share = 0.5
    count: Annotated[int, Meta(ge=1)] = 1
    late_s: Finite | None = None
    stick: tuple[Annotated[float, Meta(ge=-1.0, le=1.0)], ...] = (0.0, 0.0)
    why: Annotated[str, Meta(max_length=5)] = ""
    free: float = math.inf

    def __post_init__(self) -> None:
        check_limits(self)


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("gap_s", 0.0, "gap_s = 0.0; valid: above 0 and below 60"),
        ("gap_s", 60.0, "gap_s = 60.0; valid: above 0 and below 60"),
        ("gap_s", math.nan, "gap_s = nan; valid: above 0 and below 60"),
        ("share", 1.5, "share = 1.5; valid: 0 to 1"),
        ("count", 0, "count = 0; valid: at least 1"),
        ("count", 1.0, "count = 1.0; valid: a whole number at least 1"),
        ("late_s", math.inf, "late_s = inf; valid: a finite number"),
        ("stick", (0.0, -2.0), r"stick\[1\] = -2.0; valid: -1 to 1"),
        ("why", "longer", "why = 'longer'; valid: 0 to 5 characters"),
        ("share", "0.5", "share = '0.5'; valid: 0 to 1"),
    ],
)
def test_what_is_out_of_range_is_named_with_its_value_and_its_limit(field: str, value: Any, said: str) -> None:
    with pytest.raises(ValueError, match=f"^{said}$"):
        _Record(**{field: value})


@given(st.floats() | st.integers(-100, 100))
def test_the_same_numbers_are_refused_here_and_by_the_decoder(value: float) -> None:
    for hint in (Annotated[float, Meta(gt=0.0, le=60.0)], Finite, Share):
        try:
            msgspec.convert(value, hint)
            decoded = True
        except msgspec.ValidationError:
            decoded = False
        try:
            check_value("value", value, hint)
            checked = True
        except ValueError:
            checked = False
        assert checked == decoded


MODULES = (
    *("common.emulation.clauses", "common.emulation.loss", "common.emulation.profile"),
    *("robot_side.arm.tool_motion", "robot_side.drivers.mujoco.joint_reference", "robot_side.operators.safety"),
    *("robot_side.settings", "robot_side.viewing.settings", "operator_side.settings", "operator_side.people.settings"),
    *("operator_side.feel.rendering", "operator_side.controller.feel", "operator_side.controller.state"),
    *("operator_side.dualsense.reports.feature_report", "operator_side.dualsense.uhid.controller"),
    *("feelahead.commands.recordings", "feelahead.commands.virtual_dualsense"),
)
NEEDS: dict[type, tuple[float, ...]] = {
    **{Chance: (0.5,), Rate: (1.0,), Outage: (1.0, 1.0), RandomLoss: (0.5,), GilbertElliott: (0.5, 0.5)},
    Firmware: (0, 0, 0),
}
"""Values for the fields of a class that have no default"""


def ranges(hint: Any) -> Iterator[tuple[type, Meta]]:
    """Yield type and range of a field by its type hint; for a tuple, those of its items."""
    kind, *rest = get_args(hint) if get_args(hint) else (hint,)
    if get_origin(hint) is Annotated and (metas := [one for one in rest if isinstance(one, Meta)]):
        yield kind, metas[0]
    elif get_origin(hint) is not Annotated:
        for one in get_args(hint):
            yield from ranges(one)


def outside(kind: type, meta: Meta) -> Iterator[Any]:
    if kind is str:
        yield "x" * ((meta.max_length or 0) + 1)
        return
    step = 1 if kind is int else 1e-9
    yield from (bound for bound in (meta.gt, meta.lt) if bound is not None)
    yield from ([] if meta.ge is None else [meta.ge - step])
    yield from ([] if meta.le is None else [meta.le + (step if kind is int else max(step, 1e-9 * abs(meta.le)))])
    yield from ([0.5] if kind is int else [math.nan, math.inf, -math.inf])


@pytest.mark.parametrize("module", [importlib.import_module(name) for name in MODULES], ids=MODULES)
def test_what_lies_just_outside_of_a_declared_range_is_refused(module: ModuleType) -> None:
    for kind in vars(module).values():
        if not inspect.isclass(kind) or kind.__module__ != module.__name__ or not dataclasses.is_dataclass(kind):
            continue
        needed = dict(zip((one.name for one in dataclasses.fields(kind)), NEEDS.get(kind, ()), strict=False))
        for name, hint in get_type_hints(kind, include_extras=True).items():
            of_elements = any(get_origin(one) is tuple for one in (hint, *get_args(hint)))
            for value in [value for of, meta in ranges(hint) for value in outside(of, meta)]:
                with pytest.raises(ValueError, match=rf"^{name}\b.* = .*; valid: "):
                    kind(**(needed | {name: (value,) if of_elements else value}))


@dataclass(frozen=True)
class OneOrMany(Limited):
    rate: Annotated[float, Meta(gt=0.0)] | tuple[Annotated[float, Meta(gt=0.0)], ...] | None = None


def test_a_number_or_a_tuple_of_numbers_is_checked_as_what_it_is() -> None:
    assert (OneOrMany(2.0).rate, OneOrMany((2.0, 3.0)).rate, OneOrMany().rate) == (2.0, (2.0, 3.0), None)
    with pytest.raises(ValueError, match=r"rate = -1\.0; valid: above 0"):
        OneOrMany(-1.0)
    with pytest.raises(ValueError, match=r"rate\[1\] = -1\.0; valid: above 0"):
        OneOrMany((2.0, -1.0))
