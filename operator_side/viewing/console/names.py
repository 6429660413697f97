"""Codes (enum members) that the page shares with the operator side, as the script `names.js`."""

import json
from typing import Final, get_args

from common.protocol.messages import MotionState
from common.protocol.session import SessionState
from common.protocol.view_messages import VIEW_NAMES
from common.status.codes import Doing, InputSource, LinkState
from operator_side.viewing.facts import PictureState, ShownKind

_CODES: Final = (ShownKind, PictureState, LinkState, SessionState, Doing, InputSource)


def names() -> str:
    """Return the script: one object for each enum, and `VIEWS` in the order of the views' numbers on the wire."""
    codes = {one.__name__: {member.name: member.value for member in one} for one in _CODES}
    codes["MotionState"] = {state.upper(): state for state in get_args(MotionState)}
    lines = [f"export const {name} = Object.freeze({json.dumps(members)});" for name, members in codes.items()]
    return "\n".join([f"export const VIEWS = {json.dumps(VIEW_NAMES)};", *lines, ""])
