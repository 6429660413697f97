"""A person of one's own, who pulls with 3 N and eases off a reaction time after R2 stiffens."""

from feelahead import Episode, FingerInput

REACTION_S = 0.3


class Careful:
    """Somebody who acts at the controller while the arm is armed; a new one for each episode."""

    def __init__(self):
        self.felt_s = None

    def act(self, seen):
        """Return what the hands do from now on, None at the end. `seen` is what they see and feel."""
        if self.felt_s is None and seen.strengths[1] > 0:
            self.felt_s = seen.since_s
        if seen.since_s > 6.0:
            return None
        eased = self.felt_s is not None and seen.since_s > self.felt_s + REACTION_S
        return FingerInput(r2_n=1.0 if eased else 3.0)


class Stubborn:
    """Somebody who pulls with 3 N whatever is felt."""

    def act(self, seen):
        """Return what the hands do from now on, None at the end."""
        return FingerInput(r2_n=3.0) if seen.since_s < 6.0 else None


person = Careful

if __name__ == "__main__":
    for kind in (Stubborn, Careful):
        episode = Episode(scene="wall", link="delay 200ms", seed=3, person=kind).run()
        print(kind.__name__, [f"{hit.thing} at {1e3 * hit.speed_m_s:.0f} mm/s" for hit in episode.contacts])
