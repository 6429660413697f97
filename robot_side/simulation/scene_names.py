"""The built-in scenes by name; nothing here needs MuJoCo."""

from typing import Literal

SceneName = Literal["table", "wall", "slot", "shelf"]
