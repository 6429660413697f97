"""A hundred thousand random effects and reports: what is sent arrives, and nonsense raises one error only."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from common.errors import RemoteProtocolError
from operator_side.dualsense.effects.effect_codes import DEBUG_CODES
from operator_side.dualsense.effects.official import (
    AnyEffect,
    Feedback,
    MultiPositionFeedback,
    MultiPositionVibration,
    Off,
    SlopeFeedback,
    Vibration,
    Weapon,
)
from operator_side.dualsense.effects.unofficial_effects import (
    Bow,
    Galloping,
    Machine,
    SimpleFeedback,
    SimpleVibration,
    SimpleWeapon,
)
from operator_side.dualsense.reports.checksum import Seed, sealed
from operator_side.dualsense.reports.input_report import parse_input_report
from operator_side.dualsense.reports.output_report import OutputReport, build_output_report, parse_output_report
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.simulated.controller import SimulatedDualSense

COUNT = 100_000


class Dice:
    """Integers from a row of uniform numbers, one after the other."""

    def __init__(self, row: list[float]) -> None:
        self._row = iter(row)

    def roll(self, lowest: int, highest: int) -> int:
        return lowest + int(next(self._row) * (highest - lowest + 1))

    def ends(self, lowest: int, highest: int) -> tuple[int, int]:
        """Two different zones in order."""
        start = self.roll(lowest, highest - 1)
        return start, self.roll(start + 1, highest)

    def zones(self) -> tuple[int, ...]:
        return tuple(self.roll(0, 8) for _ in range(10))

    def byte(self) -> int:
        return self.roll(0, 255)


MAKERS: tuple[Callable[[Dice], AnyEffect], ...] = (
    lambda _: Off(),
    lambda dice: Feedback(dice.roll(0, 9), dice.roll(0, 8)),
    lambda dice: MultiPositionFeedback(dice.zones()),
    lambda dice: SlopeFeedback(*dice.ends(0, 9), dice.roll(1, 8), dice.roll(1, 8)),
    lambda dice: Weapon(*dice.ends(2, 8), dice.roll(0, 8)),
    lambda dice: Vibration(dice.roll(0, 9), dice.roll(0, 8), dice.byte()),
    lambda dice: MultiPositionVibration(dice.zones(), dice.byte()),
    lambda dice: Bow(*dice.ends(0, 8), dice.roll(1, 8), dice.roll(1, 8)),
    lambda dice: Galloping(*dice.ends(0, 9), *dice.ends(0, 7), dice.roll(1, 255)),
    lambda dice: Machine(*dice.ends(0, 9), dice.roll(0, 7), dice.roll(0, 7), dice.roll(1, 255), dice.byte()),
    lambda dice: SimpleFeedback(dice.byte(), dice.byte()),
    lambda dice: SimpleWeapon(dice.byte(), dice.byte(), dice.byte()),
    lambda dice: SimpleVibration(dice.byte(), dice.byte(), dice.byte()),
)


def random_effects(generator: np.random.Generator, count: int) -> Iterator[AnyEffect]:
    """Every kind as often as any other, every value of each of its fields as likely as any other."""
    kinds = generator.integers(0, len(MAKERS), count).tolist()
    for kind, row in zip(kinds, generator.random((count, 11)).tolist(), strict=True):
        yield MAKERS[kind](Dice(row))


def test_effects_arrive_as_they_were_sent() -> None:
    """Two a report, on both transports in turn, through bytes and the simulated controller's decoder."""
    effects = random_effects(np.random.default_rng(5), COUNT)
    devices = [SimulatedDualSense(transport) for transport in Transport]
    kinds = set()
    for number in range(COUNT // 2):
        device = devices[number % 2]
        l2, r2 = next(effects), next(effects)
        kinds |= {type(l2), type(r2)}
        report = build_output_report(OutputReport(l2, r2), device.transport, number // 2 % 16, unofficial=True)
        device.write(report, number * 1e-3)
        for sent, arrived in zip((l2, r2), device.effects, strict=True):
            assert arrived.encode() == sent.encode()
            assert arrived.zone_strengths == sent.zone_strengths or arrived == Off()
            # Of two values with the same bytes it is the simplest that arrives; any other is the very same.
            assert arrived == sent or isinstance(arrived, Off | Feedback | MultiPositionFeedback | Vibration)
    assert next(effects, None) is None
    assert len(kinds) == len(MAKERS)
    assert [device.write_count for device in devices] == [COUNT // 4] * 2


@pytest.mark.parametrize("transport", Transport)
def test_input_reports_raise_the_documented_error_or_nothing(transport: Transport) -> None:
    """Right ones, truncated and lengthened ones, ones with a wrong bit, and noise under every id and length."""
    generator = np.random.default_rng(6)
    length = 64 if transport is Transport.USB else 78
    noise = generator.bytes(COUNT // 2 * 130)
    choices = generator.integers(0, 5, COUNT // 2).tolist()
    places = generator.integers(0, 130, COUNT // 2).tolist()
    read = refused = read_right = 0
    for number, (choice, place) in enumerate(zip(choices, places, strict=True)):
        random = noise[130 * number : 130 * (number + 1)]
        right = b"\x01" + random[1:64]
        if transport is Transport.BLUETOOTH:
            right = sealed(Seed.INPUT, b"\x31" + random[1:74])
        report = right
        if choice == 1:
            report = right[: place % length]
        elif choice == 2:
            report = right + random[: 1 + place]
        elif choice == 3:
            flipped = bytearray(right)
            flipped[place % length] ^= 1 << place % 8
            report = bytes(flipped)
        elif choice == 4:
            report = random[:place]
        try:
            state = parse_input_report(report)
        except RemoteProtocolError:
            refused += 1
            continue
        read += 1
        read_right += choice == 0
        assert replace(state) == state  # which validates every field
        assert (report[0], len(report)) in ((0x01, 64), (0x31, 78), (0x01, 10), (0x01, 78))
        if transport is Transport.BLUETOOTH and choice == 3:
            pytest.fail(f"read in spite of a wrong bit: {report.hex(' ')}")
    assert read_right == choices.count(0)
    assert read + refused == COUNT // 2
    assert refused > COUNT // 8


@pytest.mark.parametrize("transport", Transport)
def test_output_reports_raise_the_documented_error_or_hold_no_debug_code(transport: Transport) -> None:
    """Noise with sound framing, in which every other effect has a known code."""
    generator = np.random.default_rng(7)
    noise = generator.bytes(COUNT // 2 * 47)
    known = bytes([0x05, 0x21, 0x25, 0x26, 0x01, 0x02, 0x06, 0x22, 0x23, 0x27, 0xFC, 0xFD, 0xFE])
    read = 0
    for number in range(COUNT // 2):
        block = bytearray(noise[47 * number : 47 * (number + 1)])
        block[10], block[21] = known[block[10] % 13], known[block[21] % 13]
        if number % 2:
            block[11:21] = bytes(10)
        report = b"\x02" + bytes(block)
        if transport is Transport.BLUETOOTH:
            start = b"\x31\x50\x10" if number % 4 < 2 else b"\x31\x02"
            report = sealed(Seed.OUTPUT, (start + block).ljust(74, b"\0"))
        try:
            output = parse_output_report(report, unofficial=True)
        except RemoteProtocolError:
            continue
        read += 1
        assert not {block[10], block[21]} & DEBUG_CODES
        if output.r2 is not None:
            assert output.r2.encode() == block[10:21]
        if output.l2 is not None:
            assert output.l2.encode() == block[21:32]
    assert read > COUNT // 40
