"""Program that looks at frozen scenes with a breakpoint inside the look, and prints the stops and the distances."""

import bdb
import json
from types import FrameType

import robot_side.field.look as module
from feelahead.lab.approaches.frozen import frozen_scene
from feelahead.lab.tick.concave import looks_before

SCENES = ("wall", "ball", "u_mesh", "table_12_tetrahedra")
FREE_MM = (8.0, 60.0)


def onsets_m() -> list[list[list[float]]]:
    """Return the onset distances (2, 8) of a look from each distance to each scene's object."""
    scenes = map(frozen_scene, SCENES)
    return [look().onsets_m.tolist() for scene in scenes for look in looks_before(scene, FREE_MM)]


class Debugger(bdb.Bdb):
    """Stops at breakpoints, and goes on at once."""

    stops = 0

    def user_line(self, frame: FrameType) -> None:
        """Count the stop."""
        self.stops += self.break_here(frame)
        self.set_continue()


if __name__ == "__main__":
    debugger = Debugger()
    debugger.set_break(module.__file__, module.look.function.__code__.co_firstlineno, funcname="look")
    found: list[list[list[list[float]]]] = []
    debugger.runcall(lambda: found.append(onsets_m()))
    print(json.dumps({"stops": debugger.stops, "onsets_m": found[0]}))
