"""Peers that a running robot side admits, read from the folder of keys."""

from dataclasses import dataclass, field

from common.errors import ConfigurationError
from common.sockets.keys import SHORTAGES, KeyFolder


@dataclass
class AllowList:
    """Admitted peers: those in `folder`, which is read again when it changes."""

    folder: KeyFolder
    names: dict[str, str] = field(default_factory=dict)
    """Names of the admitted peers, keyed by their public keys."""
    barred: frozenset[str] = frozenset()
    """Keys that are not let in at present, although they are allowed"""
    unreadable: str | None = None
    """Reason why the folder cannot be read at present; None while it can."""
    faults: tuple[str, ...] = ()
    """Faults of single files in the folder, one line each; these files admit nobody."""
    _fingerprint: tuple[tuple[str, int, int], ...] | None = None

    def refresh(self) -> set[str]:
        """Read the folder if it has changed; return the keys that were revoked. If unchanged, costs a few stat calls.

        An unreadable folder admits nobody. But if it is unreadable for lack of descriptors or memory, the list stays: a
        peer that exhausts these must not get others excluded.
        """
        before = set(self.names)
        try:
            fingerprint = self.folder.fingerprint()
            if fingerprint == self._fingerprint:
                return set()
            peers = self.folder.peers()
        except (ConfigurationError, OSError) as error:
            # Without a fingerprint the next call reads again.
            self.unreadable, self._fingerprint = str(error), None
            if getattr(error, "errno", None) not in SHORTAGES:
                self.names = {}
        else:
            self.names, self.faults, self.unreadable, self._fingerprint = peers.names, peers.faults, None, fingerprint
        return before - set(self.names)
