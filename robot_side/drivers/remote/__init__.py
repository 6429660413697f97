"""Arms and perceived objects of programs beside the robot side: MessagePack over a port (docs/drivers.md)."""
