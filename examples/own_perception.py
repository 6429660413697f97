"""A perception of one's own: a camera that loses the wall now and then."""

from common.roles import Role
from feelahead import Episode


class Losing:
    """Simulated camera that loses the wall after 2.5 s of each 5 s."""

    def __init__(self, camera):
        self.camera = camera
        self.lost = False

    def perceive(self, now_s):
        """Return the newest frame: objects at their perceived poses, in the world frame."""
        lost = now_s % 5.0 > 2.5
        if lost != self.lost:
            self.lost = lost
            self.camera.set_role("wall", Role.IGNORED if lost else Role.OBSTACLE)
        return self.camera.perceive(now_s)

    def set_role(self, name, role):
        """Change an object's role, as the operator's button for the next target does."""
        self.camera.set_role(name, role)


perception = Losing

if __name__ == "__main__":
    for name, given in {"sees the wall": None, "loses the wall": Losing}.items():
        episode = Episode(scene="wall", link="delay 50ms", seed=3, perception=given)
        episode.arm().step(6.0, r2_n=2.0)
        print(f"{name}:", [f"{hit.thing} at {1e3 * hit.speed_m_s:.0f} mm/s" for hit in episode.contacts])
