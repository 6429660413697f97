"""A recording that was cut off, written once more as a whole file with its index, message by message."""

from contextlib import suppress
from pathlib import Path
from typing import Any

from common.errors import ConfigurationError
from common.recording.reading import described, open_recording, whole_chunks
from common.recording.topics import PROFILE


def mend(path: Path, out: Path) -> int:
    """Write what is complete of `path` into the new file `out`; how many messages that are."""
    from mcap.records import Channel, Message, Schema  # noqa: PLC0415
    from mcap.writer import Writer  # noqa: PLC0415

    open_recording(path)
    count = 0
    schemas: dict[int, int] = {0: 0}
    channels: dict[int, int] = {}
    try:
        with out.open("xb") as file:
            writer = Writer(file)
            writer.start(profile=PROFILE)
            for name, values in described(path):
                writer.add_metadata(name, dict(values))
            for records in whole_chunks(path):
                record: Any
                for record in records:
                    if isinstance(record, Schema) and record.id not in schemas:
                        schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
                    elif isinstance(record, Channel) and record.id not in channels:
                        channels[record.id] = writer.register_channel(
                            record.topic, record.message_encoding, schemas[record.schema_id], record.metadata
                        )
                    elif isinstance(record, Message):
                        count += 1
                        writer.add_message(
                            channels[record.channel_id],
                            record.log_time,
                            record.data,
                            record.publish_time,
                            record.sequence,
                        )
            writer.finish()  # type: ignore[no-untyped-call]
    except FileExistsError as error:
        raise ConfigurationError(f"--out {out}: is there already; valid: a path where nothing is yet") from error
    except OSError as error:
        with suppress(OSError):
            out.unlink()
        raise ConfigurationError(f"--out {out}: cannot be written: {error.strerror}") from error
    return count
