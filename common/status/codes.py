"""Codes of a status, short and stable, for programs to compare; `common/command/words.py` has the words for people."""

from enum import StrEnum


class LinkState(StrEnum):
    """State of the link, as one side sees it."""

    WAITING = "waiting"
    """No message has arrived yet."""
    UP = "up"
    OBSERVING = "observing"
    """Another operator owns the robot."""
    REFUSED = "refused"
    """The other side refuses us, or has another protocol version."""
    LOST = "lost"
    """Messages arrived earlier, but no longer."""


class ConnectionState(StrEnum):
    """State of the controller's connection."""

    ABSENT = "absent"
    """No controller has been found yet."""
    CONNECTED = "connected"
    LOST = "lost"
    """A controller was connected, but is not at present."""


class Sight(StrEnum):
    """Whether the operator side has a recent trigger field."""

    SEEING = "seeing"
    BLIND = "blind"
    """The field is too old: triggers are free, the intent is zero."""
    WAITING = "waiting"
    """A field has arrived again, but both triggers must be released before the intent counts."""


class InputSource(StrEnum):
    """Source of the inputs that move the arm."""

    CONTROLLER = "controller"
    PERSON = "person"
    """The simulated person operates the controller."""
    BROWSER = "browser"


class Doing(StrEnum):
    """Present action of a simulated person, or of a browser page that drives the arm."""

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
    """The person would advance, but there is no target."""
    AT_REST_FIRST = "at_rest_first"
    """Of a page: all keys but hold-to-run must be released before the arm moves."""
    NOBODY_DRIVES = "nobody_drives"
    """Of a page, like the next three: no page drives."""
    ALL_KEYS_UP_FIRST = "all_keys_up_first"
    READY = "ready"
    """All keys have been released: pressing hold-to-run now takes effect."""
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
    """A person or page acts; `Doing` has the action."""
    READY_TO_ARM = "ready_to_arm"
    STARTING = "starting"


class Border(StrEnum):
    """State of a run that the colour of the console page's border shows, visible from a distance."""

    LOST = "lost"
    STOPPED = "stopped"
    ARMED = "armed"
    DISARMED = "disarmed"
    STARTING = "starting"
