"""Start of the operator side: the command `feelahead-operator`, also `python -m operator_side`."""

from common.command.launch import Command, launch


def main() -> None:
    """Run the process."""
    launch("feelahead-operator", _load, extra="operator", has_summary=True)


def _load() -> Command:
    from operator_side.main import command  # noqa: PLC0415  # large: a signal must find its handler before

    return command


if __name__ == "__main__":
    main()
