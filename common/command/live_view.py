"""A run as people see it: figures that each may be unknown, and the state in words.

A side's status values are the keys of its JSON lines. They become one frozen record here, which `live_line` writes
for a terminal and `live_story` for a file. All distances are perceived ones, never the simulation's truth.
"""

from collections.abc import Mapping
from dataclasses import dataclass

Value = float | int | str | bool | None

LINK_UP = "up"
LINK_LOST = "lost: "
"""Begins the link's word when there was one; the reason follows."""
LINK_REFUSED = "refused: "
_LARGEST = 1e300
SLOW = 0.9
"""A simulation below this share of real time is said to be slow."""
_BEFORE_ARMED = ("resting", "arming")
"""The simulated person's phases before they have seen that it is armed."""


@dataclass(frozen=True)
class TriggerView:
    """One trigger of the controller; None is not known."""

    pulled: float | None = None
    """Calibrated travel, 0 to 1."""
    resists: float | None = None
    """Stiffness, 0 to 1; 0 while the arm is not armed, as the trigger is free then."""


@dataclass(frozen=True)
class LiveView:
    """Everything that is shown; None is not known."""

    phase: str = "starting"
    """The state, in a word or two."""
    reason: str | None = None
    """Why, after a stop or a lost link."""
    alarm: bool = False
    """Whether that has stopped the arm against somebody's will."""
    state: str | None = None
    """The arm's; None while the robot side has not said."""
    armed: bool = False
    linked: bool | None = None
    real_time: float | None = None
    """The simulation's share of it."""
    delay_ms: float | None = None
    queue_ms: float | None = None
    """The queue that the robot side's own messages make in the link."""
    lost_percent: float | None = None
    """Packets that were lost on the way to the operator."""
    l2: TriggerView = TriggerView()
    r2: TriggerView = TriggerView()
    haptics: bool = True
    """Whether the triggers are stiffened at all; else `resists` only says how near danger is."""
    nearest: str | None = None
    """The nearest object's name, supports aside."""
    nearest_mm: float | None = None
    """From the gripper's surface to it, as perceived."""
    has_target: bool | None = None
    target_mm: float | None = None
    """From the gripper's surface to the target's, as perceived."""
    target_centre_mm: float | None = None
    """From the point between the fingertips to the target's centre, as perceived."""
    holding: str | None = None
    """The object between the fingers."""
    stands: bool = False
    """Whether that stands on something."""


def live_view(values: Mapping[str, Value]) -> LiveView:
    """The record of a side's status values, or of both sides' together; keys that are not there are not known."""
    phase, reason, alarm = _phase(values)
    armed, link = values.get("state") == "armed", _text(values, "link")
    free = 0.0 if values.get("state") is not None and not armed else None
    l2, r2 = (
        TriggerView(number(values.get(f"{name}_pulled")), number(values.get(name)) if free is None else free)
        for name in ("L2", "R2")
    )
    holding = _text(values, "holding")
    return LiveView(
        phase=phase,
        reason=reason,
        alarm=alarm,
        state=_text(values, "state"),
        armed=armed,
        linked=None if link is None else link == LINK_UP,
        real_time=number(values.get("real_time")),
        delay_ms=number(values.get("delay_ms")),
        queue_ms=number(values.get("queue_ms")),
        lost_percent=number(values.get("lost_percent")),
        l2=l2,
        r2=r2,
        haptics=values.get("haptics") is not False,
        nearest=_text(values, "nearest"),
        nearest_mm=number(values.get("nearest_mm")),
        has_target=values["target"] is not None if "target" in values else None,
        target_mm=number(values.get("target_mm")),
        target_centre_mm=number(values.get("target_centre_mm")),
        holding=None if holding == "nothing" else holding,
        stands=values.get("stands") is True,
    )


def _phase(values: Mapping[str, Value]) -> tuple[str, str | None, bool]:
    """The state, its reason, and whether it is an alarm: first comes a state that keeps the arm from moving."""
    link, state, person = _text(values, "link"), values.get("state"), _text(values, "person")
    because, controller = _text(values, "stopped_because"), values.get("controller")
    for beginning, word in ((LINK_LOST, "LINK LOST"), (LINK_REFUSED, "REFUSED")):
        if link is not None and link.startswith(beginning):
            return word, link.removeprefix(beginning), True
    if state == "stopped":
        return "STOPPED", because, True
    for word, so in (
        ("CONTROLLER LOST", controller == "lost"),
        ("RELEASE BOTH TRIGGERS", state == "armed" and values.get("release_first") is True),
    ):
        if so:
            return word, None, True
    if state == "disarmed" and because is not None:
        return "DISARMED", because, True
    if link not in (None, LINK_UP):
        return str(link), None, False
    if controller == "absent":
        return "no controller", None, False
    if state == "armed" and person in (None, *_BEFORE_ARMED):
        return "armed", None, False
    ready = state == "disarmed" and values.get("owner") == "ready"
    return person or ("ready to arm" if ready else str(state or "starting")), None, False


def number(value: Value) -> float | None:
    """Return a finite number; None for everything else."""
    known = isinstance(value, float | int) and not isinstance(value, bool) and -_LARGEST < value < _LARGEST
    return float(value) if known and value is not None else None


def printable(text: str) -> str:
    """Put a question mark for each sign that cannot be printed, such as a terminal's control characters."""
    return text if text.isprintable() else "".join(sign if sign.isprintable() else "?" for sign in text)


def _text(values: Mapping[str, Value], name: str) -> str | None:
    value = values.get(name)
    return printable(value) if isinstance(value, str) else None
