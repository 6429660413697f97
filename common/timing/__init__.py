"""Ages of messages, and the offset of two clocks."""
