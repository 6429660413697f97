"""Protocols of studies for tests."""

from typing import Any

from common.command.command_line import settings_of
from feelahead.study.protocol import Protocol


def protocol(**changed: Any) -> Protocol:
    """Return a small protocol: two conditions, two delays, one scene, with practice, rest and questions."""
    content: dict[str, Any] = {
        "name": "Test",
        "participants": 4,
        "seed": 7,
        "controller": "keyboard",
        "conditions": {"off": {"haptics": False}, "felt-ahead": {}},
        "scenes": ["wall"],
        "delays_ms": [0.0, 100.0],
        "trials": 1,
        "practice": {"scene": "wall", "condition": "off", "successes": 2, "most": 4},
        "rest": {"trials": 3, "seconds": 10.0},
        "items": [{"text": "It helped."}],
        "tlx": False,
    }
    return settings_of(content | changed, Protocol, "protocol")
