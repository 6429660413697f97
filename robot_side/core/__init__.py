"""Steps of a tick in their order, without I/O."""
