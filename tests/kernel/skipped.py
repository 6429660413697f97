"""What makes the kernel test impossible here, as against a failure of it."""


class SkippedError(Exception):
    """This machine cannot run the test; the text says what is missing."""
