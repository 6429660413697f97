"""Arms and perceived objects that come from separate programs: MessagePack over a port (docs/drivers.md)."""
