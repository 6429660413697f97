"""Arms and perceived objects of separate programs: MessagePack over a port (docs/drivers.md)."""
