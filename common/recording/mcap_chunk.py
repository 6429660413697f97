"""Records inside a chunk of an MCAP file, each cut off by its own length."""

import io
import struct
import zlib
from collections.abc import Iterator
from typing import IO, Any, Final

COMPRESSIONS: Final = ("", "zstd", "lz4")
_HEAD: Final = struct.Struct("<BQ")
"""Opcode and length of a record"""
_PIECE_BYTES: Final = 1 << 20


def records_of(chunk: Any) -> Iterator[Any]:
    """Yield channels and messages of a chunk (mcap.records.Chunk). ValueError or the decompressors' errors if damaged.

    Fields that a later version adds at a record's end are passed over, as the format asks of readers.
    """
    from mcap.data_stream import ReadDataStream  # noqa: PLC0415
    from mcap.opcode import Opcode  # noqa: PLC0415
    from mcap.records import Channel, Message  # noqa: PLC0415

    content, place = _unpacked(chunk), 0
    while place < len(content):
        opcode, length = _HEAD.unpack_from(content, place)
        place += _HEAD.size
        if length > len(content) - place:
            raise ValueError(f"a record of {length} bytes; valid: at most the {len(content) - place} left in the chunk")
        body = ReadDataStream(io.BytesIO(content[place : place + length]))
        if opcode == Opcode.CHANNEL:
            yield Channel.read(body)
        elif opcode == Opcode.MESSAGE:
            yield Message.read(body, length)
        place += length


def _unpacked(chunk: Any) -> bytes:
    """Return a chunk's records as bytes. All frames of a compression count; never more is unpacked than was stated."""
    packed: IO[bytes] = io.BytesIO(chunk.data)
    if chunk.compression == "zstd":
        from zstandard import ZstdDecompressor  # noqa: PLC0415

        packed = ZstdDecompressor().stream_reader(packed, read_across_frames=True)
    elif chunk.compression == "lz4":
        import lz4.frame  # type: ignore[import-untyped]  # noqa: PLC0415

        packed = lz4.frame.open(packed)
    content = bytearray()
    while piece := packed.read(min(_PIECE_BYTES, chunk.uncompressed_size + 1 - len(content))):
        content += piece
    if len(content) != chunk.uncompressed_size:
        raise ValueError(f"uncompressed_size = {chunk.uncompressed_size}; valid: the number of bytes in the chunk")
    if chunk.uncompressed_crc not in (0, zlib.crc32(content)):
        raise ValueError(f"uncompressed_crc = {chunk.uncompressed_crc}; valid: {zlib.crc32(content)}")
    return bytes(content)
