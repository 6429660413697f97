"""Schemas of the JSON topics: made from the declared types, in a form that simple tools read."""

from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from jsonschema import Draft202012Validator

from common.protocol.messages import MotionCommand, StiffnessUpdate, Telemetry
from common.recording.topics import FACTS_TOPIC, TYPES, json_schema
from operator_side.viewing.facts import OperatorFacts

ALL: dict[str, type[msgspec.Struct]] = {**TYPES, FACTS_TOPIC: OperatorFacts}


def parts(schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield schema
    inside = [*schema.get("properties", {}).values(), *schema.get("prefixItems", ())]
    if isinstance(schema.get("items"), dict):
        inside.append(schema["items"])
    for one in inside:
        yield from parts(one)


@pytest.mark.parametrize("topic", ALL)
def test_every_value_has_a_type_where_it_stands(topic: str) -> None:
    schema = json_schema(topic, ALL[topic])
    Draft202012Validator.check_schema(schema)
    assert schema["type"] == "object"
    for part in parts(schema):
        kinds = part["type"] if isinstance(part["type"], list) else [part["type"]]
        assert kinds[1:] in ([], ["null"]), part
        assert kinds[0] in ("object", "array", "string", "number", "integer", "boolean"), part
        assert not part.keys() & {"$ref", "$defs", "anyOf"}, part


@pytest.mark.parametrize(
    ("topic", "kind"), [("/stiffness", StiffnessUpdate), ("/command", MotionCommand), ("/telemetry", Telemetry)]
)
def test_a_field_that_a_message_gets_is_in_the_schema(topic: str, kind: type[msgspec.Struct]) -> None:
    declared = [one.name for one in msgspec.structs.fields(kind) if one.name != "header"]
    described = json_schema(topic, TYPES[topic])
    assert [*described["properties"]][-len(declared) :] == declared
    assert all(described["properties"][name]["description"] for name in declared if name not in ("l2", "r2", "token"))
    assert described["title"] == f"feelahead.{topic[1:].title()}"
