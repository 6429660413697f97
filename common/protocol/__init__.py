"""What crosses the wire, and who answers what."""
