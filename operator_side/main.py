"""Process `feelahead-operator`: reads the settings, makes the parts, and runs them."""

import secrets
from collections.abc import Sequence

from common.command.command_line import given_fields, parse_settings
from common.command.status import Status
from common.emulation.spec import unused_clauses
from common.loop.loop import Loop
from common.loop.process import Process
from common.sockets.authentication import OperatorKeys
from common.sockets.operator import OperatorSockets
from operator_side.controller.connection import Connection
from operator_side.controllers import OpeningParts, opening_of
from operator_side.core import OperatorSide
from operator_side.dualsense.hid.device import HidBackend
from operator_side.recorded import OperatorEncoder, build_recorded
from operator_side.settings import OperatorSettings
from operator_side.turns import REMEDY, Devices, OperatorTurns
from operator_side.viewing.console.console import Console
from operator_side.viewing.pages.driving_page import DrivingPage
from operator_side.viewing.terminal.status import TerminalStatus
from operator_side.viewing.viewing import view_topics


def command(arguments: Sequence[str], backend: HidBackend | None = None) -> int:
    """Run the operator side until --duration, Ctrl-C or SIGTERM; the triggers are released however it ends.

    If a real controller is absent or unplugged, the process waits for it. backend: used instead of hidapi, if given.
    """
    settings = parse_settings(OperatorSettings, "feelahead-operator", arguments)
    keys = None if settings.keys is None else OperatorKeys.load(settings.keys, settings.robot_key)
    status = TerminalStatus("operator") if settings.tui else Status(settings.status, "operator")
    loop = Loop(settings.tick_period_s(), REMEDY, settings.seed)
    with Process(settings, "operator", status, OperatorEncoder(), loop) as process:
        # The console first, as its process takes longest to start, and before the priority is raised, which the process
        # would inherit.
        console = None
        if settings.console:
            port, token, back = settings.console_port, settings.console_token, settings.console_back
            console = Console(settings.connect, port=port, token=token, back=back)
            process.stack.enter_context(console)
        topics, connections = view_topics(settings), settings.connections
        sockets = OperatorSockets(
            settings.connect, settings.view_connect, topics=topics, keys=keys, connections=connections
        )
        process.stack.enter_context(sockets)
        core = build_recorded(settings, secrets.randbits(53), process.recording)
        if settings.device == "browser" and not settings.console:
            process.note("no page can drive: --device browser is given without --console")
        for text in unused_clauses(settings.link_spec(), [("to_robot", "haptics")]):
            process.note(text)
        desk = _desk(settings, core, process, backend, console)
        stored_travel = "calibration" not in given_fields(arguments, OperatorSettings)
        return process.run(lambda: OperatorTurns(settings, core, desk, sockets, process, stored_travel=stored_travel))


def _desk(
    settings: OperatorSettings,
    core: OperatorSide,
    process: Process,
    backend: HidBackend | None,
    console: Console | None,
) -> Devices:
    """Open the controller, and return it with the page and the console."""
    pages, stack = DrivingPage(), process.stack
    search, guard, person = opening_of(settings.device, OpeningParts(settings, core, pages, backend))
    pages.may_drive = person is not None
    if guard is not None:
        stack.enter_context(guard)
    connection = Connection(search, core, guard)
    stack.callback(connection.close)
    return Devices(connection, guard, person, pages, console)
