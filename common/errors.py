"""The exceptions of feelahead.

    FeelaheadError
    ├── ConfigurationError   what a person asked for cannot be done (also a ValueError); a command prints it
    │                        as one line and ends with exit code 2
    ├── RemoteProtocolError  the peer sent what is no valid message; it is counted and dropped whole
    │   └── OtherVersionError    the peer speaks another version of the protocol
    └── DeviceError          the controller is unreadable or gone; the text says what to do about it
        ├── NoDeviceError        there is none; one may be plugged in at any time
        └── NoDriverError        what reads controllers is missing (also a ConfigurationError): no waiting mends that

Arguments of public functions that are out of range raise a plain ValueError that names the argument.
"""


class FeelaheadError(Exception):
    """The root of everything that feelahead raises on purpose."""


class ConfigurationError(FeelaheadError, ValueError):
    """A setting, flag or file asks for something impossible; the text names the value and what is valid."""


class RemoteProtocolError(FeelaheadError):
    """Bytes from the peer that are no valid message of this protocol version."""


class OtherVersionError(RemoteProtocolError):
    """A message of another version of the protocol: the two sides are of different releases."""


class DeviceError(FeelaheadError):
    """The controller cannot be opened, read or written."""


class NoDeviceError(DeviceError):
    """No controller is connected."""


class NoDriverError(DeviceError, ConfigurationError):
    """hidapi is missing, broken or shadowed by another package."""
