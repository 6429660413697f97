"""Check of a recording's JSON messages against the schemas that the file itself gives, by others' packages."""

import json
from pathlib import Path

from jsonschema import Draft202012Validator
from mcap.reader import make_reader


def fitting_topics(path: Path) -> set[str]:
    """Assert that each JSON message fits the schema of its topic; return the topics."""
    checks: dict[int, Draft202012Validator] = {}
    topics = set()
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.message_encoding != "json":
                continue
            assert schema is not None, channel.topic
            check = checks.setdefault(schema.id, Draft202012Validator(json.loads(schema.data)))
            for error in check.iter_errors(json.loads(message.data)):
                raise AssertionError(f"{channel.topic}: {error.json_path}: {error.message:.200}")
            topics.add(channel.topic)
    return topics
