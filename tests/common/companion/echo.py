"""Companion process for tests: sends each message back until the other end is gone."""

import select
import sys

from common.companion.process import companion_channel


def main() -> None:
    channel, _ = companion_channel(sys.argv[1:])
    while not channel.ended:
        select.select([channel], [channel] if channel.waiting else [], [])
        for message in channel.receive():
            channel.send(message)


if __name__ == "__main__":
    main()
