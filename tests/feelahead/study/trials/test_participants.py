"""Simulated participants differ from each other, learn, and lapse as often as drawn."""

import numpy as np

from feelahead.study.trials.participants import Participant


def test_persons_differ_and_the_same_number_is_the_same_person() -> None:
    people = [Participant.drawn(3, number) for number in range(1, 201)]
    assert people[4] == Participant.drawn(3, 5)
    assert people[4] != Participant.drawn(4, 5)
    reactions_s = [one.person.visual_reaction_s for one in people]
    assert abs(np.mean(reactions_s) - 0.231) < 3 * 0.03 / np.sqrt(200)
    assert 0.02 < np.std(reactions_s) < 0.04


def test_practice_takes_a_share_of_the_error_away_and_never_all() -> None:
    one = Participant.drawn(0, 1)
    spreads_m = [one.at(practised, 9).depth_error_sd_m for practised in (0, 15, 30, 1000)]
    assert spreads_m == sorted(spreads_m, reverse=True)
    assert spreads_m[0] == one.person.depth_error_sd_m
    assert 0.55 < spreads_m[-1] / spreads_m[0] < 0.65


def test_a_lapse_is_a_trial_without_trust_and_as_rare_as_drawn() -> None:
    one = Participant.drawn(0, 2)
    lapses = np.mean([one.at(0, seed).trust == 0.0 for seed in range(4000)])
    assert abs(lapses - one.lapses) < 3 * np.sqrt(0.05 / 4000) + 1e-9


def test_answers_stay_on_the_scale_and_rise_with_hits() -> None:
    one = Participant.drawn(0, 3)
    seeds = [[0, 3, block] for block in range(50)]
    calm, hurt = ([one.answer(1.0, 7.0, hits, seed) for seed in seeds] for hits in (0.0, 1.0))
    assert np.mean(hurt) > np.mean(calm)
    assert 1.0 <= min(calm + hurt) <= max(calm + hurt) <= 7.0
