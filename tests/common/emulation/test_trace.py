import gzip
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from common.emulation.clauses import LinkModel
from common.emulation.delay_line import DelayLine
from common.emulation.profile import LinkProfile
from common.emulation.trace import Trace, read_samples
from common.errors import ConfigurationError
from tests.helpers.refusal import refusal


def written(folder: Path, content: str, name: str = "trace.csv") -> Path:
    path = folder / name
    path.write_text(content)
    return path


@pytest.mark.parametrize(
    ("content", "delays_ms"),
    [
        ("delay_ns\n1000000\n\n2000000\n", [1.0, 2.0]),
        ("delay_ns,note\n1000000,a\n,lost\n2000000,b\n", [1.0, None, 2.0]),
        ("sent_ns,delay_ns\n5,1000000\n3,2000000\n4,\n", [2.0, None, 1.0]),
        ("sent_ns,received_ns\n0,1000000\n1000000,\n2000000,2500000\n", [1.0, None, 0.5]),
        # In order of arrival, and nothing of number 1: all that a receiver can record.
        ("seq,sent_ns,delay_ns\n3,3,5000000\n0,0,9000000\n2,2,7000000\n", [9.0, None, 7.0, 5.0]),
        ("\ufeffdelay_ns\n1000000\n", [1.0]),
    ],
)
def test_reads_delays_in_order_of_sending(tmp_path: Path, content: str, delays_ms: list[float | None]) -> None:
    trace = Trace.read(written(tmp_path, content), "trace")
    assert [None if delay_s is None else 1e3 * delay_s for delay_s in trace.delays_s] == pytest.approx(delays_ms)


def test_reads_compressed_files(tmp_path: Path) -> None:
    path = tmp_path / "trace.csv.gz"
    path.write_bytes(gzip.compress(b"delay_ns\n1000000\n"))
    assert Trace.read(path, "trace").delays_s == pytest.approx([1e-3])
    path.write_bytes(gzip.compress(b"delay_ns\n1000000\n" * 99)[:-12])
    with pytest.raises(ConfigurationError, match=r"trace\.csv\.gz"):
        Trace.read(path, "trace")


@pytest.mark.parametrize(
    ("rest", "named"),
    [
        (b"\n", "has too many rows; valid: up to 1000 rows"),
        (b"1\n", "has too many rows; valid: up to 1000 rows"),
        (b" ", "row 1: has too long a line; valid: up to 100 characters"),
    ],
)
def test_a_small_file_that_unpacks_to_a_large_one_is_refused_before_it_fills_the_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rest: bytes, named: str
) -> None:
    monkeypatch.setattr("common.emulation.trace._MOST_ROWS", 1000)
    monkeypatch.setattr("common.emulation.trace._LONGEST_LINE", 100)
    path = tmp_path / "bomb.csv.gz"
    path.write_bytes(gzip.compress(b"delay_ns\n" + rest * 4_000_000))
    tracemalloc.start()
    try:
        assert named in refusal(Trace.read, path, "trace")
        assert tracemalloc.get_traced_memory()[1] < 1e6
    finally:
        tracemalloc.stop()


def test_lost_messages_were_sent_between_their_neighbours(tmp_path: Path) -> None:
    sent_s, delay_s = read_samples(written(tmp_path, "seq,sent_ns,delay_ns\n0,0,1\n3,3000000000,1\n"), "trace")
    assert sent_s.tolist() == pytest.approx([0.0, 1.0, 2.0, 3.0])
    assert np.isnan(delay_s).tolist() == [False, True, True, False]


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("", "the columns none"),
        ("sent_ns\n1\n", "the columns sent_ns"),
        ("delay_ns\n\n", "no message in it arrives"),
        ("delay_ns\nsoon\n", "row 1: delay_ns = 'soon'"),
        ("delay_ns\n5\nnan\n", "row 2: delay_ns = 'nan'"),
        ("delay_ns\n-5\n", "row 1: the delay is -5 ns"),
        ("sent_ns,received_ns\n,5\n", "row 1: sent_ns is empty"),
        ("seq,delay_ns\n0,5\n99999999,5\n", "seq reaches from 0 to 99999999"),
    ],
)
def test_a_bad_trace_is_refused_in_one_line(tmp_path: Path, content: str, named: str) -> None:
    path = written(tmp_path, content)
    text = refusal(LinkProfile.parse, f"trace {path}")
    assert named in text
    assert str(path) in text
    assert "valid: " in text


@pytest.mark.parametrize("clause", ["delay 5ms", "loss 1%"])
def test_a_trace_stands_for_delay_and_loss(tmp_path: Path, clause: str) -> None:
    path = written(tmp_path, "delay_ns\n1\n")
    with pytest.raises(ConfigurationError, match=f"excludes '{clause.split(maxsplit=1)[0]}'"):
        LinkProfile.parse(f"trace {path} {clause}")


def deliveries(profile: LinkProfile, count: int) -> dict[int, float]:
    """Send messages 1 s apart; return the delay in milliseconds of each that arrives."""
    line: DelayLine[int] = DelayLine(profile)
    delays_ms = {}
    for number in range(count):
        line.push(float(number), number)
        while (due_s := line.next_due()) is not None and due_s < number + 1.0:
            delays_ms.update({arrived: 1e3 * (due_s - arrived) for arrived in line.pop(due_s)})
    return delays_ms


def test_a_trace_is_replayed_by_position_and_restarts_at_its_end(tmp_path: Path) -> None:
    path = written(tmp_path, "delay_ns,x\n1000000,\n,\n3000000,\n")
    profile = LinkProfile.parse(f"trace {path}")
    assert deliveries(profile, 7) == pytest.approx({0: 1.0, 2: 3.0, 3: 1.0, 5: 3.0, 6: 1.0})


@pytest.mark.parametrize(("model", "delay_ms"), [("datagram", None), ("stream", 50.0 + 20.0)])
def test_what_a_trace_loses_a_stream_sends_again(tmp_path: Path, model: LinkModel, delay_ms: float | None) -> None:
    path = written(tmp_path, "delay_ns,x\n10000000,\n,\n20000000,\n")
    retransmit = " retransmit 50ms" if model == "stream" else ""
    assert deliveries(LinkProfile.parse(f"trace {path}{retransmit}", 2, model), 3).get(1) == (
        None if delay_ms is None else pytest.approx(delay_ms)
    )
