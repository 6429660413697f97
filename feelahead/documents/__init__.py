"""Documents of which a command writes a part."""
