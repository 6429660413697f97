"""Codes of a status, short and stable, for programs to compare; `common/command/words.py` has the words for people."""

from enum import StrEnum


class LinkState(StrEnum):
    """State of the link, as one side sees it."""

    WAITING = "waiting"
    """No message has arrived yet."""
    UP = "up"
    """Messages arrive."""
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
    """The person touches nothing, for the second that arming requires."""
    ARMING = "arming"
    """The arming button is being pressed."""
    ADVANCING = "advancing"
    """The person brings the gripper to the target."""
    GRASPING = "grasping"
    """The person closes the gripper."""
    RETREATING = "retreating"
    """A grasp held nothing: the person opens the gripper and draws back, to aim again."""
    LIFTING = "lifting"
    """The person lifts the object."""
    CARRYING = "carrying"
    """The person carries the object towards the robot."""
    LOWERING = "lowering"
    """The person lowers the object until it stands."""
    LETTING_GO = "letting_go"
    """The person opens the gripper."""
    DRAWING_BACK = "drawing_back"
    """The person moves the gripper away from the object that was set down."""
    PULLING = "pulling"
    """A finger that does nothing else pulls a trigger."""
    DONE = "done"
    """The person's task has ended, or was given up."""
    NO_TARGET = "no_target"
    """The person would advance, but there is no target."""
    AT_REST_FIRST = "at_rest_first"
    """A page drives, and all its keys but hold-to-run must be released before the arm moves."""
    NOBODY_DRIVES = "nobody_drives"
    """No page drives."""
    ALL_KEYS_UP_FIRST = "all_keys_up_first"
    """A page is to drive, which begins after a second without any input."""
    READY = "ready"
    """All keys of the page have been released, so pressing hold-to-run now takes effect."""
    RUNNING = "running"
    """The inputs of a page move the arm."""


class Phase(StrEnum):
    """Phase of a run; `common/status/phase.py` has the order of severity."""

    LINK_LOST = "link_lost"
    """Messages arrived earlier, but no longer."""
    REFUSED = "refused"
    """The robot side refuses us, for the reason beside it."""
    STOPPED = "stopped"
    """The emergency stop was pressed, and has been neither reset nor followed by arming."""
    CONTROLLER_LOST = "controller_lost"
    """The controller was there, and no longer is."""
    RELEASE_BOTH_TRIGGERS = "release_both_triggers"
    """The trigger field was lost and is back; the triggers have not been released yet."""
    DISARMED = "disarmed"
    """The arm stands still. In capitals, with the reason: it was armed, or was to be armed."""
    WAITING = "waiting"
    """The other side has not been heard yet."""
    OBSERVING = "observing"
    """Another operator owns the robot."""
    NO_CONTROLLER = "no_controller"
    """No controller has been found yet."""
    ARMED = "armed"
    """The arm follows the commands."""
    BUSY = "busy"
    """A person or page acts; `Doing` has the action."""
    READY_TO_ARM = "ready_to_arm"
    """All inputs have been at rest for a second: the arming button arms."""
    STARTING = "starting"
    """The state of the arm is not known yet."""


class Border(StrEnum):
    """State of a run that the colour of the console page's border shows, visible from a distance."""

    LOST = "lost"
    STOPPED = "stopped"
    ARMED = "armed"
    DISARMED = "disarmed"
    STARTING = "starting"
