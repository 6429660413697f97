"""Requirements of the public functions on their arguments."""
