"""Console script `feelahead-robot`, the same as `python -m robot_side`."""

from common.command.launch import Command, launch, single_threaded_algebra


def main() -> None:
    """Run the robot side's process."""
    single_threaded_algebra()
    launch("feelahead-robot", _load, extra="robot", has_summary=True)


def _load() -> Command:
    from robot_side.main import command  # noqa: PLC0415  # large: a signal must find its handler before

    return command


if __name__ == "__main__":
    main()
