"""Pictures that real cameras send, as far as the views use them."""

from typing import Literal, Protocol

from common.protocol.view_messages import VIEW_NAMES, Eye, ViewName
from robot_side.viewing.mount import MountSettings, Pinhole, mounted_eye


class SentPicture(Protocol):
    """Newest picture of a view, still encoded: its bytes are a stranger's."""

    @property
    def width(self) -> int:
        """Width in pixels, as its sender says"""
        ...

    @property
    def height(self) -> int:
        """Height in pixels, as its sender says"""
        ...

    @property
    def format(self) -> Literal["jpeg", "rgb8"]:
        """Format of `content`"""
        ...

    @property
    def content(self) -> bytes:
        """Picture: JPEG, or red, green and blue of each pixel, row by row"""
        ...

    @property
    def captured_s(self) -> float:
        """Earliest possible time of capture, on our clock"""
        ...

    @property
    def intrinsics(self) -> Pinhole | None:
        """Intrinsics of the camera; None if its sender does not say them"""
        ...


class SentPictures(Protocol):
    """Source of the newest picture of each view that is sent."""

    def update(self, now_s: float, *, watched: bool) -> None:
        """Take the pictures that have arrived. watched: whether somebody looks."""
        ...

    def sends(self, view: ViewName) -> bool:
        """Return whether a picture of this view has ever come."""
        ...

    def fresh(self, view: ViewName) -> bool:
        """Return whether a picture of this view has come since the last `take`."""
        ...

    def take(self, view: ViewName) -> SentPicture | None:
        """Return the newest picture of a view; None if it was taken before, or none has come."""
        ...

    def newest(self, view: ViewName) -> SentPicture | None:
        """Return the newest picture of a view, taken or not; None if none has come."""
        ...

    def refuse(self, view: ViewName, text: str, now_s: float) -> None:
        """Refuse the picture of a view that was taken last: it cannot be decoded."""
        ...


def sent_eyes(sent: SentPictures, mounts: MountSettings) -> dict[ViewName, Eye | None]:
    """Return the viewpoint of each view that is sent; None if its mount or its intrinsics are unknown."""
    eyes: dict[ViewName, Eye | None] = {}
    for view in VIEW_NAMES:
        if (picture := sent.newest(view)) is not None:
            mount = mounts.overview if view == "overview" else mounts.first_person
            pinhole = picture.intrinsics
            eyes[view] = None
            if mount is not None and pinhole is not None:
                eyes[view] = mounted_eye(mount, pinhole, picture.width, picture.height)
    return eyes
