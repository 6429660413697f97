"""The test program inside the virtual machine."""

import platform
import sys


def main() -> int:
    print(f"hello from the kernel {platform.release()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
