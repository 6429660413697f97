"""Stand-in for a browser with the console's page: it receives all data, and measures number and ages of the pictures.

Usage: page ADDRESS, the console's address, which the operator side prints at its start.
"""

import asyncio
import math
import struct
import sys
import time
from typing import Final
from urllib.parse import urlsplit

import msgspec
import numpy as np
from websockets.asyncio.client import connect
from websockets.typing import Origin

from operator_side.viewing.console.pages import ROUND_ENDS

_PICTURE: Final = struct.Struct("<Bd")
"""First bytes of a picture's message: the view, and the time of capture by the clock that both hosts share"""


async def look(address: str) -> dict[str, float]:
    """Receive until the standard input ends; return pictures a second, and quantiles of their ages on arrival."""
    ends = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    origin = Origin("http://" + urlsplit(address).netloc)
    ages_s: list[float] = []
    async with connect(address.replace("http", "ws") + "live", origin=origin) as opened:
        began_s = time.monotonic()
        while not ends.done():
            coming = asyncio.ensure_future(opened.recv())
            await asyncio.wait([coming, ends], return_when=asyncio.FIRST_COMPLETED)
            if not coming.done():
                coming.cancel()
                break
            message = coming.result()
            if isinstance(message, bytes):
                ages_s.append(time.monotonic() - _PICTURE.unpack_from(message)[1])
            elif message == ROUND_ENDS:
                await opened.send('{"taken":true}')
        seconds = time.monotonic() - began_s
    p50, p95 = 1e3 * np.quantile(ages_s or [math.nan], (0.5, 0.95))
    known = {"picture_p50_ms": float(p50), "picture_p95_ms": float(p95)} if ages_s else {}
    return {"pictures_s": len(ages_s) / seconds} | known


if __name__ == "__main__":
    sys.stdout.write(msgspec.json.encode(asyncio.run(look(sys.argv[1]))).decode() + "\n")
