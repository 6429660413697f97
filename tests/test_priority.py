import os
import subprocess
import sys

CODE = (
    "from common.priority import raise_priority; import os; print(raise_priority(), os.getpriority(os.PRIO_PROCESS, 0))"
)


def test_it_says_whether_the_priority_was_granted() -> None:
    ended = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    granted, niceness = ended.stdout.split()
    assert granted == str(int(niceness) <= -10)
    assert int(niceness) <= os.getpriority(os.PRIO_PROCESS, 0)
