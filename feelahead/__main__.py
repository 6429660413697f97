"""Console script `feelahead`, also `python -m feelahead`."""

from common.command.launch import Command, launch


def main() -> None:
    """Run the command."""
    launch("feelahead", _load)


def _load() -> Command:
    from feelahead.main import command  # noqa: PLC0415  # large: the signal handlers come first

    return command


if __name__ == "__main__":
    main()
