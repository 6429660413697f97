"""Recordings as other tools write them again: legal forms of MCAP, by the writer of the package `mcap`."""

import io
import struct
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer

_MAGIC: Final = 8
_FOOTER: Final = 9 + 20
_DESCRIBING: Final = (Opcode.SCHEMA, Opcode.CHANNEL)
BARE: Final[Mapping[str, Any]] = {
    **{"index_types": IndexType.NONE, "repeat_channels": False, "repeat_schemas": False},
    **{"use_statistics": False, "use_summary_offsets": False},
}
"""The writer's arguments for a file that has nothing between its data and its footer"""


def rewritten(
    source: Path,
    *,
    order: Callable[[Message], Any] | None = None,
    shuffled: int | None = None,
    channels: int = 1,
    schemas: bool = True,
    metadata_last: bool = False,
    notes_ns: int | None = None,
    finish: Callable[[bytes], bytes] = bytes,
    **options: Any,
) -> bytes:
    """Write the messages and metadata of the file `source` again.

    order: key by which messages are sorted. shuffled: seed of a random order. channels: number of channels of each
    topic, which take turns. notes_ns: stamp of a message of another tool's topic. finish: change of the written bytes.
    options: the writer's.
    """
    with source.open("rb") as file:
        records = list(StreamReader(file).records)
    messages = [one for one in records if isinstance(one, Message)]
    if order is not None:
        messages.sort(key=order)
    if shuffled is not None:
        messages = [messages[row] for row in np.random.default_rng(shuffled).permutation(len(messages))]
    metadata = {one.name: one.metadata for one in records if isinstance(one, Metadata)}
    output = io.BytesIO()
    writer: Any = Writer(output, **options)
    writer.start(profile="", library="another tool")
    if not metadata_last:
        _describe(writer, metadata)
    known = {one.id: one for one in records if isinstance(one, Schema)}
    ids: dict[int, list[int]] = {}
    for channel in {one.id: one for one in reversed(records) if isinstance(one, Channel)}.values():
        schema = known.get(channel.schema_id) if schemas else None
        schema_id = 0 if schema is None else writer.register_schema(schema.name, schema.encoding, schema.data)
        ids[channel.id] = [
            writer.register_channel(channel.topic, channel.message_encoding, schema_id) for _ in range(channels)
        ]
    for number, one in enumerate(messages):
        channel_id = ids[one.channel_id][number % channels]
        writer.add_message(channel_id, one.log_time, one.data, one.publish_time, one.sequence)
    if notes_ns is not None:
        writer.add_message(writer.register_channel("/notes", "json", 0), notes_ns, b"{}", notes_ns)
    if metadata_last:
        _describe(writer, metadata)
    writer.finish()
    return finish(output.getvalue())


def _describe(writer: Any, metadata: Mapping[str, dict[str, str]]) -> None:
    writer.add_attachment(0, 0, "notes.txt", "text/plain", b"of another tool")
    for name, values in metadata.items():
        writer.add_metadata(name, values)


def _with_private_record(content: bytes) -> bytes:
    (length,) = struct.unpack_from("<Q", content, _MAGIC + 1)
    place = _MAGIC + 9 + length
    return content[:place] + b"\x80" + struct.pack("<Q", 5) + b"other" + content[place:]


def _further_fields(records: bytes) -> tuple[str, bytes, bytes]:
    padded, place = bytearray(), 0
    while place < len(records):
        opcode, length = struct.unpack_from("<BQ", records, place)
        body = records[place + 9 : place + 9 + length] + (b"further" if opcode in _DESCRIBING else b"")
        padded += struct.pack("<BQ", opcode, len(body)) + body
        place += 9 + length
    return "", bytes(padded), bytes(padded)


def _two_frames(name: str, compress: Callable[[bytes], bytes]) -> Callable[[bytes], tuple[str, bytes, bytes]]:
    return lambda records: (name, records, compress(records[:100]) + compress(records[100:]))


def _with_chunks(change: Callable[[bytes], tuple[str, bytes, bytes]]) -> Callable[[bytes], bytes]:
    """Return what changes a file's uncompressed chunks: their records to a compression, records, and packed records."""

    def changed(content: bytes) -> bytes:
        output, place = bytearray(content[:_MAGIC]), _MAGIC
        while place < len(content) - _MAGIC:
            opcode, length = struct.unpack_from("<BQ", content, place)
            body, place = content[place + 9 : place + 9 + length], place + 9 + length
            if opcode == Opcode.CHUNK:
                name, records, packed = change(body[40:])
                sizes = struct.pack("<QII", len(records), zlib.crc32(records), len(name))
                body = body[:16] + sizes + name.encode() + struct.pack("<Q", len(packed)) + packed
            output += struct.pack("<BQ", opcode, len(body)) + body
        return bytes(output) + content[-_MAGIC:]

    return changed


_CHUNKS: Final[Mapping[str, Any]] = {"compression": CompressionType.NONE, "chunk_size": 3000, **BARE} | {
    "repeat_channels": True
}
FORMS: Final[Mapping[str, Mapping[str, Any]]] = {
    "zstd": {},
    "lz4": {"compression": CompressionType.LZ4},
    "not compressed, without checksums": {"compression": CompressionType.NONE, "enable_crcs": False},
    "many small chunks": {"chunk_size": 300},
    "one chunk": {"chunk_size": 1 << 30},
    "without an index": BARE,
    "without chunks": {"use_chunking": False, "enable_data_crcs": True},
    "without chunks and index": {"use_chunking": False, **BARE},
    "newest first": {"order": lambda one: -one.log_time, "chunk_size": 3000},
    "newest first, without chunks": {"order": lambda one: -one.log_time, "use_chunking": False},
    "by topic": {"order": lambda one: one.channel_id, "chunk_size": 3000},
    "shuffled": {"shuffled": 1, "chunk_size": 3000},
    "shuffled, without chunks": {"shuffled": 2, "use_chunking": False, **BARE},
    "two channels for each topic": {"channels": 2},
    "without schemas": {"schemas": False},
    "metadata at the end": {"metadata_last": True, "use_chunking": False},
    "a record of a private kind": {"finish": _with_private_record},
    "without a footer": {**BARE, "finish": lambda content: content[: -_MAGIC - _FOOTER]},
    "further fields in chunks": {**_CHUNKS, "finish": _with_chunks(_further_fields)},
    "two frames of zstd": {**_CHUNKS, "finish": _with_chunks(_two_frames("zstd", zstandard.compress))},
    "two frames of lz4": {**_CHUNKS, "finish": _with_chunks(_two_frames("lz4", lz4.frame.compress))},
    "another end": {"finish": lambda content: content[:-_MAGIC] + bytes(_MAGIC)},
}
"""Arguments of `rewritten`, by a name of the form"""
