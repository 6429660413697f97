"""Check of both sides' files of settings, before a side is started with them."""

from pathlib import Path

from common.command.command_line import load_toml


def check_settings_files(robot: Path | None, operator: Path | None) -> None:
    """Raise ConfigurationError for a file that its side would refuse; None: without a file."""
    if robot is not None:
        from robot_side.settings import RobotSettings  # noqa: PLC0415

        load_toml(robot, RobotSettings, flag="--robot-config")
    if operator is not None:
        from operator_side.settings import OperatorSettings  # noqa: PLC0415

        load_toml(operator, OperatorSettings, flag="--operator-config")
