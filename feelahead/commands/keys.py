"""`feelahead keys`: make a side's key pair, and choose which operators the robot side admits."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn, get_args

from common.errors import ConfigurationError
from common.sockets.authentication import make_key_pair, public_part
from common.sockets.key_files import KEY_ROLES
from common.sockets.keys import KeyFolder, Side, checked_name, default_folder, read_public_key

_STEPS = """\
Two machines, from nothing to a link that is encrypted and open to nobody else:

  robot      feelahead keys make robot              prints ROBOT-KEY
  operator   feelahead keys make operator           prints OPERATOR-KEY
  robot      feelahead keys allow NAME OPERATOR-KEY
  robot      feelahead-robot --bind tcp://0.0.0.0:5555 --keys {folder}
  operator   feelahead-operator --connect tcp://ROBOT:5555 --keys {folder} --robot-key ROBOT-KEY

A key that is printed is public: it may go by mail. The secret half never leaves the folder.
`allow` and `revoke` work while the robot side runs, within a second.
"""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise ConfigurationError(f"keys: {message} (valid: {self.prog} --help)")


def keys(arguments: Sequence[str]) -> int:
    """Run the subcommand that `arguments` begin with; raises ConfigurationError for bad input."""
    parsed = _parser().parse_args(list(arguments))
    folder = KeyFolder(parsed.folder)
    said: list[str] = []
    match parsed.action:
        case "make":
            said = _make(folder, parsed.side, replace=parsed.replace)
        case "show":
            said = [public_part(folder.secret(parsed.side))]
        case "allow":
            name, key = checked_name(parsed.name), read_public_key(parsed.key, "key")
            folder.allow(name, key, parsed.role)
            said = [f"{name} is let in as {parsed.role}; to end that: {folder.command(f'revoke {name}')}"]
        case "revoke":
            folder.revoke(parsed.name)
            said = [f"{parsed.name} is revoked; a running robot side cuts the connection within a second"]
        case "list":
            said = _listed(folder)
    sys.stdout.write("\n".join(said) + "\n")
    return 0


def _parser() -> argparse.ArgumentParser:
    default = default_folder()
    common = _Parser(add_help=False)
    common.add_argument(
        "--folder", type=Path, default=default, metavar="FOLDER", help=f"the folder of keys ({default})"
    )
    parser = _Parser(
        prog="feelahead keys",
        description="Keys (CURVE) for the link between the robot side and its operators.",
        epilog=_STEPS.format(folder=default),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    sides = get_args(Side)
    make = actions.add_parser("make", parents=[common], help="make this side's key pair, and print the public part")
    make.add_argument("side", choices=sides)
    make.add_argument("--replace", action="store_true", help="replace an existing pair")
    show = actions.add_parser("show", parents=[common], help="print the public part again")
    show.add_argument("side", choices=sides)
    allow = actions.add_parser("allow", parents=[common], help="let an operator in (on the robot's machine)")
    allow.add_argument("name", metavar="NAME", help="a name for it: up to 32 letters, digits, - and _")
    allow.add_argument("key", metavar="KEY|FILE", help="the public key, or the .public file")
    allow.add_argument(
        "--role",
        choices=KEY_ROLES,
        default="operator",
        help="what it may do: operator drives and watches, observer watches, driver is the arm's driver at --arm,"
        " perception sends objects to --objects and pictures to --pictures (operator)",
    )
    actions.add_parser("list", parents=[common], help="list the keys in the folder, and the admitted peers")
    revoke = actions.add_parser("revoke", parents=[common], help="revoke an operator's key")
    revoke.add_argument("name", metavar="NAME")
    return parser


def _make(folder: KeyFolder, side: Side, *, replace: bool) -> list[str]:
    public, secret = make_key_pair()
    folder.write_pair(side, public, secret, replace=replace)
    if side == "robot":
        following = [
            f"start it with: feelahead-robot --bind tcp://0.0.0.0:5555 --keys {folder.path}",
            f"let an operator in with: {folder.command('allow NAME OPERATOR-KEY')}",
            f"on its machine: feelahead-operator --connect tcp://ROBOT:5555 --keys FOLDER --robot-key {public}",
        ]
    else:
        following = [
            f"on the robot's machine: feelahead keys allow NAME {public}",
            f"then here: feelahead-operator --connect tcp://ROBOT:5555 --keys {folder.path} --robot-key ROBOT-KEY",
        ]
    return [f"public key of this {side} side: {public}", *following]


def _listed(folder: KeyFolder) -> list[str]:
    lines = [f"folder   {folder.path}"]
    for side in get_args(Side):
        if folder.secret_path(side).exists():
            lines.append(f"own      {side:<32} {public_part(folder.secret(side))}")
    peers = folder.peers()
    lines += [
        f"allowed  {name:<32} {key} {peers.roles[key]}"
        for key, name in sorted(peers.names.items(), key=lambda item: item[1])
    ]
    lines += [f"passed over: {fault}" for fault in peers.faults]
    if len(lines) == 1:
        lines.append(f"empty; to begin: {folder.command('make robot')}, or make operator")
    return lines
