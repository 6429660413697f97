"""Codes of a status: short and stable, for programs to compare; `common/command/words.py` has the words."""

from enum import StrEnum


class LinkState(StrEnum):
    """State of the link, as one side sees it."""

    WAITING = "waiting"
    """No message has arrived yet."""
    UP = "up"
    OBSERVING = "observing"
    """Another operator owns the robot."""
    REFUSED = "refused"
    """The other side refuses us, or is of another version."""
    LOST = "lost"
    """Messages arrived once, and none do now."""


class ConnectionState(StrEnum):
    """State of the controller's connection."""

    ABSENT = "absent"
    """No controller has been found yet."""
    CONNECTED = "connected"
    LOST = "lost"
    """A controller was connected, and is gone."""


class Sight(StrEnum):
    """State of the trigger field at the operator side."""

    SEEING = "seeing"
    BLIND = "blind"
    """The field has expired: intent is zero."""
    WAITING = "waiting"
    """The field is back, but both triggers must be released first."""


class Hands(StrEnum):
    """Source of the hands that move the arm."""

    CONTROLLER = "controller"
    PERSON = "person"
    """The simulated person."""
    BROWSER = "browser"


class Doing(StrEnum):
    """Action of the hands at the controller, or at a page that drives."""

    RESTING = "resting"
    ARMING = "arming"
    ADVANCING = "advancing"
    GRASPING = "grasping"
    RETREATING = "retreating"
    LIFTING = "lifting"
    CARRYING = "carrying"
    LOWERING = "lowering"
    LETTING_GO = "letting_go"
    DRAWING_BACK = "drawing_back"
    PULLING = "pulling"
    DONE = "done"
    NO_TARGET = "no_target"
    """The hands would advance, but there is no target."""
    AT_REST_FIRST = "at_rest_first"
    """A page's: all keys but hold-to-run must be released before the arm moves."""
    NOBODY_DRIVES = "nobody_drives"
    """This and the next three are a page's, too."""
    ALL_KEYS_UP_FIRST = "all_keys_up_first"
    READY = "ready"
    """Hold-to-run takes effect."""
    RUNNING = "running"


class Phase(StrEnum):
    """Phase of a run; `common/status/phase.py` has the order of severity."""

    LINK_LOST = "link_lost"
    REFUSED = "refused"
    STOPPED = "stopped"
    CONTROLLER_LOST = "controller_lost"
    RELEASE_BOTH_TRIGGERS = "release_both_triggers"
    DISARMED = "disarmed"
    WAITING = "waiting"
    OBSERVING = "observing"
    NO_CONTROLLER = "no_controller"
    ARMED = "armed"
    BUSY = "busy"
    """The hands act; `Doing` tells how."""
    READY_TO_ARM = "ready_to_arm"
    STARTING = "starting"


class Look(StrEnum):
    """Colour of the page's border: a run's state, seen from afar."""

    LOST = "lost"
    STOPPED = "stopped"
    ARMED = "armed"
    DISARMED = "disarmed"
    STARTING = "starting"
