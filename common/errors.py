"""Exceptions of feelahead.

    FeelaheadError
    ├── ConfigurationError   a person's wish cannot be met (also a ValueError); a command prints the error as one
    │                        line and ends with exit code 2
    ├── RemoteProtocolError  the peer sent an invalid message, which is counted and dropped whole
    │   └── OtherVersionError    the peer speaks another version of the protocol
    └── DeviceError          the controller is unreadable or gone; the text names a remedy
        ├── NoDeviceError        none is connected; one may be plugged in at any time
        └── NoDriverError        the library for controllers is missing (also a ConfigurationError): do not wait

Public functions raise a plain ValueError, which names the argument, for arguments out of range.
"""


class FeelaheadError(Exception):
    """Base of all errors that feelahead raises on purpose."""


class ConfigurationError(FeelaheadError, ValueError):
    """Impossible setting, flag or file; the text names the value and what is valid."""


class RemoteProtocolError(FeelaheadError):
    """Bytes from the peer that are no valid message of this protocol version."""


class OtherVersionError(RemoteProtocolError):
    """Message of another protocol version: the two sides are of different releases."""


class DeviceError(FeelaheadError):
    """The controller cannot be opened, read or written."""


class NoDeviceError(DeviceError):
    """No controller is connected."""


class NoDriverError(DeviceError, ConfigurationError):
    """hidapi is missing, broken or shadowed by another package."""
