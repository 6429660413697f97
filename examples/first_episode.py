"""A finger pulls R2 with 2 N towards a wall, over 200 ms each way. Haptics stop it before the wall."""

from feelahead import Episode

for haptics in (False, True):
    episode = Episode(scene="wall", link="delay 200ms", seed=3, haptics=haptics)
    episode.arm().step(6.0, r2_n=2.0)  # 6 s of virtual time
    for contact in episode.contacts:
        print(f"haptics {haptics}: hits the {contact.thing} at {1e3 * contact.speed_m_s:.0f} mm/s")
    print(f"haptics {haptics}: least gap {1e3 * episode.history.true_gap_m.min():.1f} mm")
