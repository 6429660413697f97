"""A law of one's own, against the built-in one.

It is also one of the commands': feelahead try approach --law examples/own_law.py
"""

from feelahead import Episode


class Nearness:
    """R2 is the stiffer, the nearer the nearest thing is; L2 is free."""

    free_m = 0.08

    def __init__(self, inputs):
        self.inputs = inputs  # a feelahead.LawInputs: arm, errors, surroundings, and what most laws need

    def sense(self, situation, now_s):
        """Return the stiffness of both triggers, a thousand times a second at most."""
        near_m = self.inputs.nearest_m(situation, self.free_m)
        return self.inputs.sensed(situation, l2=0.0, r2=1.0 - near_m / self.free_m)


law = Nearness

if __name__ == "__main__":
    for name, given in {"swept": "swept", "nearness": Nearness}.items():
        episode = Episode(scene="wall", link="delay 200ms", seed=3, law=given)
        history = episode.arm().step(6.0, r2_n=2.0).history
        moved_mm = 1e3 * (history.tool_position_m[-1] - history.tool_position_m[0])
        print(
            f"{name}: advances {max(abs(moved_mm)):.0f} mm, {len(episode.contacts)} contacts,"
            f" least gap {1e3 * history.true_gap_m.min():.1f} mm"
        )
