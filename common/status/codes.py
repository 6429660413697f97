"""Codes of a status: short and stable, so that programs compare them; `common/command/words.py` has the words."""

from enum import StrEnum


class LinkState(StrEnum):
    """The link to the other side, as one side sees it."""

    WAITING = "waiting"
    """Nothing has been heard yet."""
    UP = "up"
    OBSERVING = "observing"
    """Another operator owns the robot."""
    REFUSED = "refused"
    """The other side does not let us in, or is of another version."""
    LOST = "lost"
    """Something was heard once, and nothing is now."""


class ConnectionState(StrEnum):
    """Whether there is a controller."""

    ABSENT = "absent"
    """No controller has been found yet."""
    CONNECTED = "connected"
    LOST = "lost"
    """There was one."""


class Sight(StrEnum):
    """Whether what is ahead is known."""

    SEEING = "seeing"
    BLIND = "blind"
    """The field has expired: hands move nothing."""
    WAITING = "waiting"
    """The field is back, and both triggers have to be released first."""


class Hands(StrEnum):
    """Whose hands move the arm."""

    CONTROLLER = "controller"
    PERSON = "person"
    """The scripted one's."""
    BROWSER = "browser"


class Doing(StrEnum):
    """What the hands at the controller, or at a page that drives, do."""

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
    """They would advance, and there is no target."""
    AT_REST_FIRST = "at_rest_first"
    """A page's: all but hold-to-run has to be let go of before anything moves."""
    NOBODY_DRIVES = "nobody_drives"
    """This and the next three are a page's, too."""
    ALL_KEYS_UP_FIRST = "all_keys_up_first"
    READY = "ready"
    """Hold-to-run counts."""
    RUNNING = "running"


class Phase(StrEnum):
    """Where a run stands; `common/status/phase.py` has their order."""

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
    """The hands are at what `Doing` says."""
    READY_TO_ARM = "ready_to_arm"
    STARTING = "starting"


class Look(StrEnum):
    """How a run looks from afar: the page's border."""

    LOST = "lost"
    STOPPED = "stopped"
    ARMED = "armed"
    DISARMED = "disarmed"
    STARTING = "starting"
