"""Exceptions of feelahead.

    FeelaheadError
    ├── ConfigurationError   a setting, flag or file cannot be used (also a ValueError); a command prints the error
    │                        as one line and ends with exit code 2
    ├── RemoteProtocolError  the peer sent an invalid message, which is counted and dropped whole
    │   └── OtherVersionError    the peer has another version of the protocol
    └── DeviceError          the controller cannot be read or written; the text names a remedy
        ├── NoDeviceError        no controller is connected, but one may be connected at any time
        └── NoDriverError        the library for controllers is missing (also a ConfigurationError); waiting is useless

Public functions raise a plain ValueError, which names the argument, for arguments out of range.
"""


class FeelaheadError(Exception):
    """Base of all errors that feelahead raises on purpose."""


class ConfigurationError(FeelaheadError, ValueError):
    """Setting, flag or file that cannot be used; the text names the value and what is valid."""


class RemoteProtocolError(FeelaheadError):
    """The peer sent bytes that are no valid message of this protocol version."""


class OtherVersionError(RemoteProtocolError):
    """The peer sent a message of another protocol version: the two sides are of different releases."""


class DeviceError(FeelaheadError):
    """The controller cannot be opened, read or written."""

    def __init__(self, said: str, remedy: str = "") -> None:
        super().__init__(f"{said}: {remedy}" if remedy else said)
        self.said = said
        self.remedy = remedy


class NoDeviceError(DeviceError):
    """No controller is connected."""


class NoDriverError(DeviceError, ConfigurationError):
    """The library hidapi is missing, broken or shadowed by another package."""
