"""Scheduler of a dask cluster: its address, and the certificates by which its machines know each other."""

import re
import ssl
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path

from common.sockets.endpoints import resolve

_ADDRESS = re.compile(r"(tcp|tls)://([^\s/\[\]:]+|\[[^\s/\[\]]+\]):\d{1,5}")


@dataclass(frozen=True)
class Scheduler:
    """Address of a scheduler; for tls:// also three files in PEM. Raises ValueError if they do not fit together."""

    address: str
    authority: Path | None = None
    """Certificate of the authority that signed the certificate of each machine in the cluster"""
    certificate: Path | None = None
    """Certificate of this machine"""
    key: Path | None = None
    """Secret key of this machine"""

    def __post_init__(self) -> None:
        found = _ADDRESS.fullmatch(self.address)
        if found is None:
            raise ValueError(
                f"--scheduler {self.address!r}: is no address; valid: an address such as tcp://127.0.0.1:8786"
                " or tls://127.0.0.1:8786"
            )
        given = [path for path in (self.authority, self.certificate, self.key) if path is not None]
        if found[1] == "tcp" and given:
            raise ValueError(
                f"--scheduler {self.address}: is not encrypted, so {given[0]} has no use; valid: tls://HOST:PORT"
            )
        if found[1] == "tls":
            if len(given) < 3:
                raise ValueError(
                    f"--scheduler {self.address}: needs certificates; valid: also --tls-ca, --tls-cert and --tls-key, "
                    "files made as feelahead/lab/README.md says"
                )
            self._require_usable_files()

    def warning(self) -> str | None:
        """Return a line that says what is open to others; None if nothing is."""
        scheme, _, rest = self.address.partition("://")
        host = rest.rpartition(":")[0].strip("[]")
        if scheme == "tls" or ip_address(resolve(host, self.address, "--scheduler")[0].partition("%")[0]).is_loopback:
            return None
        return (
            f"--scheduler {self.address}: not encrypted, and anyone who reaches it runs code on its machines and on "
            "this one; tls://HOST:PORT admits certificates only"
        )

    def _require_usable_files(self) -> None:
        authority, certificate, key = (Path(path or "") for path in (self.authority, self.certificate, self.key))
        if key.exists() and (mode := key.stat().st_mode & 0o777) & 0o077:
            raise ValueError(
                f"--tls-key {key}: other users may read it (mode {mode:04o}); valid: mode 0600, "
                f"set by `chmod 600 {key}`"
            )
        flags = f"--tls-ca {authority}"
        try:
            context = ssl.create_default_context(cafile=authority)
            flags = f"--tls-cert {certificate}, --tls-key {key}"
            # An empty password, as otherwise a terminal would be asked for one.
            context.load_cert_chain(certificate, key, password="")
        except OSError as error:  # as are those of ssl
            reason = getattr(error, "reason", None) or error.strerror
            raise ValueError(
                f"{flags}: cannot be used ({reason}); valid: files in PEM without a password, made as "
                "feelahead/lab/README.md says"
            ) from error
