"""Follow docs/two-machines.md on two machines in network namespaces, then try what goes wrong: `make test-two-hosts`.

Needs root and iproute2; nftables and libfaketime for a row each.
"""

import argparse
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from types import FrameType

from common.errors import FeelaheadError
from feelahead.lab.faults.two_machines import NotPermittedError, two_machines
from tests.kernel.waiting import CheckError
from tests.two_hosts import network_rows, people_rows
from tests.two_hosts.guide import GuideError
from tests.two_hosts.lan import Lan

Row = tuple[str, Callable[[Lan], str]]

ROWS: tuple[Row, ...] = (
    ("the guide, robot side first", network_rows.as_the_guide_says),
    ("cable pulled", network_rows.cable_pulled),
    ("operator's address changes", network_rows.operators_address),
    ("robot's address changes", network_rows.robots_address),
    ("all is swallowed", network_rows.swallowed),
    ("packets of 576 bytes", network_rows.small_packets),
    ("second operator, unknown key", people_rows.second_operator),
    ("name server silent", network_rows.silent_name_server),
    ("revoked while driving", people_rows.revoked_while_driving),
    ("robot side killed", people_rows.robot_killed),
    ("operator side killed", people_rows.operator_killed),
    ("operator side first", people_rows.operator_first),
    ("wall clock stepped an hour", people_rows.wall_clock),
)


def main() -> int:
    """0 when every row held or the test was skipped, which the last line says."""
    parser = argparse.ArgumentParser(prog="python -m tests.two_hosts", description=__doc__)
    parser.add_argument("only", nargs="*", help="words: only rows with one of these in their names")
    words = [word.lower() for word in parser.parse_args().only]
    rows = [row for row in ROWS[1:] if not words or any(word in row[0] for word in words)]
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _leave)
    began_s = time.monotonic()
    try:
        with two_machines() as machines, tempfile.TemporaryDirectory(prefix="feelahead-hosts-") as folder:
            failed = _try_all(Lan(*machines, Path(folder)), [ROWS[0], *rows])
    except NotPermittedError as reason:
        print(f"skipped: {reason}")
        return 0
    print(f"failed: {', '.join(failed)}" if failed else f"passed in {time.monotonic() - began_s:.0f} s")
    return 1 if failed else 0


def _try_all(lan: Lan, rows: list[Row]) -> list[str]:
    """The names of those that failed."""
    failed: list[str] = []
    try:
        for name, row in rows:
            began_s = time.monotonic()
            try:
                if failed:
                    lan.mend()
                verdict, measured = "holds", row(lan)
            except network_rows.NotJudgedError as reason:
                verdict, measured = "not judged", str(reason)
            except Exception as error:
                known = isinstance(error, (CheckError, GuideError, FeelaheadError))
                verdict, measured = "FAILED", str(error) if known else traceback.format_exc()
                failed.append(name)
            print(f"{time.monotonic() - began_s:4.0f} s  {verdict:<10}  {name:<28}  {measured}", flush=True)
            if failed == [ROWS[0][0]]:
                break  # nothing after it means anything
    finally:
        lan.end_all()
    return failed


def _leave(number: int, frame: FrameType | None) -> None:
    """By way of everything that has to be put in order."""
    del frame
    sys.exit(128 + number)


if __name__ == "__main__":
    sys.exit(main())
