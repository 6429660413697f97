"""Addresses of the form tcp://HOST:PORT, checked before a socket uses them."""

import ipaddress
import re
import socket
from dataclasses import dataclass

from common.errors import ConfigurationError
from common.sockets.keys import default_folder

_ADDRESS = re.compile(r"tcp://(?:\[(?P<v6>[^\[\]]+)\]|(?P<host>[^\s:/\[\];]+)):(?P<port>[^\s:/]+)")
_EPHEMERAL = 0
_HIGHEST_PORT = 65535


@dataclass(frozen=True)
class Endpoint:
    """Address to bind to or to connect to."""

    host: str
    """Host name, IP address without brackets, or * for every address of this machine."""
    port: int
    """Port number; 0 lets the system choose a free one."""
    ipv6: bool
    """Whether the host is reached by IPv6 only."""

    @property
    def address(self) -> str:
        """The address in the form tcp://HOST:PORT."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"tcp://{host}:{'*' if self.port == _EPHEMERAL else self.port}"

    def is_loopback(self) -> bool:
        """Return whether only this machine can reach the address."""
        return self.host != "*" and ipaddress.ip_address(self.host.partition("%")[0]).is_loopback


def parse_bind(text: str, flag: str) -> Endpoint:
    """Parse an address to bind to; a host name is replaced by its numeric address.

    Port 0 or * lets the system choose. Raises ConfigurationError, which names `flag`, `text` and what is valid.
    """
    host, port_text = _split(text, flag, "tcp://127.0.0.1:5555")
    port = _EPHEMERAL if port_text == "*" else _port(port_text, text, flag, lowest=0)
    if host == "*":
        return Endpoint(host, port, ipv6=False)
    numeric, ipv6 = resolve(host, text, flag)
    return Endpoint(numeric, port, ipv6)


def parse_connect(text: str, flag: str) -> Endpoint:
    """Parse an address to connect to, and check that its host name resolves; the endpoint keeps the name.

    Raises ConfigurationError, which names `flag`, `text` and what is valid.
    """
    host, port = split_connect(text, flag)
    return Endpoint(host, port, resolve(host, text, flag)[1])


def split_connect(text: str, flag: str) -> tuple[str, int]:
    """Return host and port of an address to connect to, without resolving the host. Errors as in parse_connect."""
    host, port_text = _split(text, flag, "tcp://192.168.1.5:5555")
    port = _port(port_text, text, flag, lowest=1)
    if host == "*":
        raise ConfigurationError(f"{flag}: {text!r} names no host to connect to; valid: tcp://HOST:PORT")
    return host, port


def resolve(host: str, text: str, flag: str) -> tuple[str, bool]:
    """Return the host's numeric address, IPv4 if there is one, and whether it is IPv6; raises ConfigurationError."""
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or "no valid host name"
        raise ConfigurationError(
            f"{flag}: {host!r} in {text!r} cannot be resolved ({reason}); "
            "valid: an IP address, or a host name that this machine knows"
        ) from error
    for family, _, _, _, address in found:
        if family == socket.AF_INET:
            return str(address[0]), False
    return str(found[0][4][0]), True


def view_after(control: Endpoint, text: str, flag: str) -> Endpoint:
    """Return the view's default endpoint: the port after the control port; if that is 0 (any port), also 0."""
    if control.port == _HIGHEST_PORT:
        raise ConfigurationError(
            f"{flag}: the control address {text!r} leaves no port after it for the view; "
            f"valid: a control port up to {_HIGHEST_PORT - 1}, or {flag} tcp://HOST:PORT"
        )
    port = _EPHEMERAL if control.port == _EPHEMERAL else control.port + 1
    return Endpoint(control.host, port, control.ipv6)


def parse_operators(bind: str, view_bind: str | None, *, guarded: bool) -> tuple[Endpoint, Endpoint]:
    """Parse the addresses of the control port and of the view port; None: the port after that of `bind`.

    guarded: whether it may be open to the network. Raises ConfigurationError.
    """
    control = parse_bind(bind, "--bind")
    view = view_after(control, bind, "--view-bind") if view_bind is None else parse_bind(view_bind, "--view-bind")
    if not guarded:
        refuse_open(control, bind, "--bind")
        refuse_open(view, view_bind or bind, "--view-bind")
    return control, view


def parse_driver(bind: str, flag: str, *, guarded: bool) -> Endpoint:
    """Parse the address of a port for a user's program, as `parse_operators` does."""
    endpoint = parse_bind(bind, flag)
    if not guarded:
        refuse_open(endpoint, bind, flag)
    return endpoint


def refuse_open(endpoint: Endpoint, text: str, flag: str) -> None:
    """Raise ConfigurationError, which names remedies, if other machines could reach `endpoint`."""
    if not endpoint.is_loopback():
        raise ConfigurationError(
            f"{flag}: {text!r} would be open to anyone on the network; valid: --keys {default_folder()} "
            "(first: `feelahead keys make robot`), a loopback address such as tcp://127.0.0.1:5555, or --insecure"
        )


def _split(text: str, flag: str, example: str) -> tuple[str, str]:
    match = _ADDRESS.fullmatch(text)
    if match is None:
        raise ConfigurationError(f"{flag}: {text!r} is no address; valid: tcp://HOST:PORT such as {example}")
    return match["v6"] or match["host"], match["port"]


def _port(port_text: str, text: str, flag: str, lowest: int) -> int:
    if not re.fullmatch(r"[0-9]{1,5}", port_text) or not lowest <= int(port_text) <= _HIGHEST_PORT:
        raise ConfigurationError(f"{flag}: {port_text!r} in {text!r} is no port; valid: {lowest} to {_HIGHEST_PORT}")
    return int(port_text)
