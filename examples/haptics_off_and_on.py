"""The same finger without and with haptics: where the gripper is, and what the finger meets.

Run: python examples/haptics_off_and_on.py [FILE.png]
"""

import sys

import matplotlib.pyplot as plt

from feelahead import Episode

L2, R2 = range(2)
figure, (gap, strength) = plt.subplots(2, sharex=True, layout="constrained")
for haptics in (False, True):
    episode = Episode(scene="wall", link="delay 200ms", seed=3, haptics=haptics)
    history = episode.arm().step(6.0, r2_n=2.0).history
    label = f"haptics {'on' if haptics else 'off'}"
    since_s = history.time_s - episode.acts_since_s
    gap.plot(since_s, 1e3 * history.true_gap_m, label=label)
    strength.plot(since_s, history.strength[:, R2], label=label)
    hits = ", ".join(f"the {hit.thing} at {1e3 * hit.speed_m_s:.0f} mm/s" for hit in episode.contacts)
    print(f"{label}: hits {hits or 'nothing'}")
gap.set(ylabel="gap to the nearest thing, mm", ylim=(-1, None))
strength.set(ylabel="strength at R2, of 8", xlabel="time since the finger pulls, s", xlim=(0, None))
gap.legend()
if sys.argv[1:]:
    figure.savefig(sys.argv[1])
else:
    plt.show()
