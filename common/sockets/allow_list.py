"""Whom a running robot side lets in: the folder of keys, looked at again and again."""

from dataclasses import dataclass, field

from common.errors import ConfigurationError
from common.sockets.keys import SHORTAGES, KeyFolder


@dataclass
class AllowList:
    """Whom a running side lets in: the folder's peers, read again whenever the folder has changed."""

    folder: KeyFolder
    names: dict[str, str] = field(default_factory=dict)
    """The name of each key."""
    unreadable: str | None = None
    """Why the folder cannot be read at the moment; None while it can."""
    faults: tuple[str, ...] = ()
    """What is wrong with single files, which let nobody in, a line each."""
    _fingerprint: tuple[tuple[str, int, int], ...] | None = None

    def refresh(self) -> set[str]:
        """Look at the folder, a few stat calls; the keys that were let in before and are no more.

        A folder that cannot be read lets nobody in, unless that is for want of descriptors or memory: nobody who can
        use those up is to throw others out.
        """
        before = set(self.names)
        try:
            fingerprint = self.folder.fingerprint()
            if fingerprint == self._fingerprint:
                return set()
            peers = self.folder.peers()
        except (ConfigurationError, OSError) as error:
            # Without a fingerprint the next look reads again.
            self.unreadable, self._fingerprint = str(error), None
            if getattr(error, "errno", None) not in SHORTAGES:
                self.names = {}
        else:
            self.names, self.faults, self.unreadable, self._fingerprint = peers.names, peers.faults, None, fingerprint
        return before - set(self.names)
