"""The test program inside the virtual machine: each check in turn, and how it went."""

import platform
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from functools import partial

from operator_side.dualsense.transport import Transport
from tests.kernel.checks_device import DEVICE_CHECKS
from tests.kernel.checks_driver import DRIVER_CHECKS
from tests.kernel.plugged import Plugged, Variant

VARIANTS = tuple(Variant(transport, edge) for transport in Transport for edge in (False, True))


def main(words: Sequence[str]) -> int:
    """0 when every check whose name has one of `words` in it (all, without any) passed."""
    print(f"Linux {platform.release()}, Python {platform.python_version()}")
    passed, failed = 0, 0
    for variant in VARIANTS:
        wanted = [
            check for check in (*DRIVER_CHECKS, *DEVICE_CHECKS) if _is_wanted(f"{variant.name}: {_title(check)}", words)
        ]
        if not wanted:
            continue
        with Plugged(variant) as plugged:
            for check in wanted:
                if _passes(f"{variant.name}: {_title(check)}", partial(check, plugged)):
                    passed += 1
                else:
                    failed += 1
    print(f"{passed} passed, {failed} failed")
    return 0 if passed and not failed else 1


def _title(check: Callable[..., str]) -> str:
    return (check.__doc__ or check.__name__).splitlines()[0].rstrip(".")


def _is_wanted(name: str, words: Sequence[str]) -> bool:
    return not words or any(word.lower() in name.lower() for word in words)


def _passes(name: str, run: Callable[[], str]) -> bool:
    started_s = time.monotonic()
    try:
        detail = run()
    except Exception:
        print(f"FAILED {name}\n{traceback.format_exc()}")
        return False
    print(f"ok     {name} ({detail}; {time.monotonic() - started_s:.1f} s)")
    return True


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
