"""Peers that a running robot side admits, read from the folder of keys."""

from collections.abc import Collection
from dataclasses import dataclass, field

from common.errors import ConfigurationError
from common.sockets.key_files import SHORTAGES, KeyRole
from common.sockets.keys import KeyFolder


@dataclass
class AllowList:
    """Admitted peers: those in `folder`, which is read again when it changes."""

    folder: KeyFolder
    names: dict[str, str] = field(default_factory=dict)
    """Names of the admitted peers, keyed by their public keys."""
    roles: dict[str, KeyRole] = field(default_factory=dict)
    """Roles of the admitted peers, keyed by their public keys"""
    revoked: list[str] = field(default_factory=list)
    """Names that were revoked, or got another role, since the caller emptied it"""
    barred: frozenset[str] = frozenset()
    """Keys that are not let in at present, although they are allowed"""
    unreadable: str | None = None
    """Reason why the folder cannot be read at present; None while it can."""
    faults: tuple[str, ...] = ()
    """Faults of single files in the folder, one line each; these files admit nobody."""
    _fingerprint: tuple[tuple[str, int, int], ...] | None = None

    def refresh(self) -> set[str]:
        """Read the folder if it has changed; return the keys that were revoked, or have another role.

        If it is unchanged, this costs a few stat calls.

        An unreadable folder admits nobody. But if it is unreadable for lack of descriptors or memory, the list stays: a
        peer that exhausts these must not get others excluded.
        """
        before, names = self.roles, self.names
        try:
            fingerprint = self.folder.fingerprint()
            if fingerprint == self._fingerprint:
                return set()
            peers = self.folder.peers()
        except (ConfigurationError, OSError) as error:
            # Without a fingerprint the next call reads again.
            self.unreadable, self._fingerprint = str(error), None
            if getattr(error, "errno", None) not in SHORTAGES:
                self.names, self.roles = {}, {}
        else:
            self.names, self.roles, self.faults, self.unreadable, self._fingerprint = (
                *(peers.names, peers.roles, peers.faults),
                None,
                fingerprint,
            )
        revoked = {key for key, role in before.items() if self.roles.get(key) != role}
        self.revoked += [names[key] for key in revoked]
        return revoked

    def admits(self, key: str, roles: Collection[KeyRole]) -> bool:
        """Return whether a key is allowed, has one of these roles, and is not barred."""
        return self.roles.get(key) in roles and key not in self.barred
