"""Twenty seeds at four delays, on every core: how near to the next thing does a finger of 2 N stop?

Run: python examples/twenty_seeds.py [FILE.png] [SEEDS]
"""

import sys
from concurrent.futures import ProcessPoolExecutor
from itertools import product

import matplotlib.pyplot as plt
import numpy as np

from feelahead import Episode

DELAYS_MS = (0, 100, 200, 400)


def gap_mm(delay_ms, seed):
    """Return the least gap; the seed draws the wall's place and the errors of arm, camera and link."""
    episode = Episode(scene="wall", link=f"delay {delay_ms}ms", seed=seed)
    return 1e3 * episode.arm().step(6.0, r2_n=2.0).history.true_gap_m.min()


if __name__ == "__main__":
    seeds = range(int(sys.argv[2]) if sys.argv[2:] else 20)
    runs = list(product(DELAYS_MS, seeds))
    with ProcessPoolExecutor() as pool:
        gaps_mm = np.reshape(list(pool.map(gap_mm, *zip(*runs, strict=True))), (len(DELAYS_MS), len(seeds)))
    for delay_ms, each in zip(DELAYS_MS, gaps_mm, strict=True):
        print(f"{delay_ms} ms: gap {each.min():.1f} to {each.max():.1f} mm, median {np.median(each):.1f} mm")
    plt.boxplot(list(gaps_mm), tick_labels=DELAYS_MS)
    plt.xlabel("delay each way, ms")
    plt.ylabel("least gap, mm")
    if sys.argv[1:]:
        plt.savefig(sys.argv[1])
    else:
        plt.show()
