"""The test program inside the virtual machine: each check in turn, and how it went."""

import platform
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.reports.transport import Transport
from tests.kernel.checks_command import lives
from tests.kernel.checks_device import DEVICE_CHECKS
from tests.kernel.checks_driver import DRIVER_CHECKS
from tests.kernel.checks_operator import OPERATOR_CHECKS, Desk
from tests.kernel.operator_process import Operator
from tests.kernel.plugged import Plugged, Variant

VARIANTS = tuple(Variant(transport, model) for transport in Transport for model in Model)


@dataclass
class Score:
    """How the checks went."""

    words: Sequence[str]
    """Only checks with one of these in their names are made; all without any."""
    passed: int = 0
    failed: int = 0

    def wanted(self, variant: Variant, check: Callable[..., str]) -> bool:
        """Whether to make this check."""
        return not self.words or any(word.lower() in _name(variant, check).lower() for word in self.words)

    def make(self, variant: Variant, check: Callable[..., str], *given: object) -> None:
        """Make one check, and say how it went."""
        if not self.wanted(variant, check):
            return
        started_s = time.monotonic()
        try:
            detail = partial(check, *given)()
        except Exception:
            self.failed += 1
            print(f"FAILED {_name(variant, check)}\n{traceback.format_exc()}")
            return
        self.passed += 1
        print(f"ok     {_name(variant, check)} ({detail}; {time.monotonic() - started_s:.1f} s)")


def main(words: Sequence[str]) -> int:
    """0 when every wanted check passed, and there was one."""
    print(f"Linux {platform.release()}, Python {platform.python_version()}")
    score = Score(words)
    # The operator side is the same for the Edge.
    operators = {
        variant: Operator()
        for variant in VARIANTS
        if variant.model is Model.DUALSENSE and any(score.wanted(variant, check) for check in OPERATOR_CHECKS)
    }
    for variant in VARIANTS:
        with Plugged(variant) as plugged:
            for check in (*DRIVER_CHECKS, *DEVICE_CHECKS):
                score.make(variant, check, plugged)
    for variant, operator in operators.items():
        with Desk(operator) as desk, Plugged(variant) as plugged:
            for operator_check in OPERATOR_CHECKS:
                score.make(variant, operator_check, plugged, desk)
    wireless = Variant(Transport.BLUETOOTH)
    score.make(wireless, lives, wireless)
    print(f"{score.passed} passed, {score.failed} failed")
    return 0 if score.passed and not score.failed else 1


def _name(variant: Variant, check: Callable[..., str]) -> str:
    return f"{variant.name}: {(check.__doc__ or check.__name__).splitlines()[0].rstrip('.')}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
