import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

import msgspec
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import serve
from websockets.exceptions import ConnectionClosed

from operator_side.viewing.console.pages import MOST_PAGES, PASSED_ON, ROUND_ENDS, Pages
from operator_side.viewing.pages.page_messages import PageMessage

TAKEN = '{"taken":true}'
Opens = Callable[[], contextlib.AbstractAsyncContextManager[ClientConnection]]


class Desk:
    def __init__(self) -> None:
        self.counts: list[int] = []
        self.heard: list[tuple[str, Any]] = []
        self.pages = Pages(
            self.counts.append, lambda kind, said: self.heard.append((kind, msgspec.msgpack.decode(said)))
        )

    async def until(self, so: Callable[[], bool]) -> None:
        async with asyncio.timeout(20.0):
            while not so():
                await asyncio.sleep(0.001)


@contextlib.asynccontextmanager
async def served(desk: Desk) -> AsyncIterator[Opens]:
    async with serve(desk.pages.serve, "127.0.0.1", 0, close_timeout=0.1) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        yield lambda: connect(f"ws://127.0.0.1:{port}/")


def run(story: Callable[[Desk, Opens], Awaitable[None]]) -> Desk:
    async def all_of_it() -> Desk:
        desk = Desk()
        async with served(desk) as opens:
            await story(desk, opens)
        return desk

    return asyncio.run(all_of_it())


async def a_round(page: ClientConnection) -> list[str | bytes]:
    messages: list[str | bytes] = []
    while (message := await page.recv()) != ROUND_ENDS:
        messages.append(message)
    return messages


def test_a_page_gets_what_lasts_and_every_note_at_once() -> None:
    async def story(desk: Desk, opens: Opens) -> None:
        desk.pages.show("run", "title", lasting=True)
        desk.pages.show("facts", "gone by then")
        desk.pages.note("first")
        desk.pages.note("second")
        async with opens() as page:
            assert sorted(map(str, await a_round(page))) == ["first", "second", "title"]

    assert run(story).counts == [1, 0]


def test_a_page_that_is_slow_misses_all_but_the_newest_of_each_kind() -> None:
    async def story(desk: Desk, opens: Opens) -> None:
        async with opens() as slow, opens() as quick:
            await desk.until(lambda: desk.counts == [1, 2])
            desk.pages.show("facts", "0")
            assert await a_round(slow) == await a_round(quick) == ["0"]
            for number in range(1, 100):
                desk.pages.show("facts", f"{number}")
                desk.pages.show("overview", b"%d" % number)
            # The page has not confirmed the first batch, so that nothing more was sent, and no queue grew.
            await quick.send(TAKEN)
            assert await a_round(quick) == ["99", b"99"]
            await slow.send(TAKEN)
            assert await a_round(slow) == ["99", b"99"]

    run(story)


def test_what_hands_and_sliders_say_is_passed_on_with_the_pages_number() -> None:
    async def story(desk: Desk, opens: Opens) -> None:
        async with opens() as first, opens() as second:
            await first.send('{"hands": {"keys": ["w"]}}')
            await desk.until(lambda: len(desk.heard) == 1)
            await second.send('{"tune": {"probability": 0.9}, "hands": {"keys": []}}')
            await desk.until(lambda: len(desk.heard) == 2)
            await second.send('{"play": {"paused": true}}')
            await desk.until(lambda: len(desk.heard) == 3)
            await first.send('{"mark": "start"}')
            await desk.until(lambda: len(desk.heard) == 4)
        await desk.until(lambda: len(desk.heard) == 6)

    heard = run(story).heard
    assert heard[:4] == [
        ("s", [1, {"hands": {"keys": ["w"]}}]),
        ("s", [2, {"hands": {"keys": []}, "tune": {"probability": 0.9}}]),
        ("s", [2, {"play": {"paused": True}}]),
        ("s", [1, {"mark": "start"}]),
    ]
    # The inputs of a closed page are released.
    assert sorted(page for _, (page, said) in heard[4:] if said is None) == [1, 2]


def test_all_that_a_page_may_say_reaches_the_operator_side() -> None:
    assert {*PageMessage.__struct_fields__, "play", "again"} == set(PASSED_ON)


def test_a_page_that_reports_slow_counts_until_it_is_gone() -> None:
    async def story(desk: Desk, opens: Opens) -> None:
        async with opens() as page:
            assert not desk.pages.slow
            await page.send('{"slow": true}')
            await desk.until(lambda: desk.pages.slow)
        await desk.until(lambda: not desk.pages.slow)

    run(story)


@pytest.mark.parametrize(
    "nonsense",
    [
        b"{}",
        "",
        '{"hands": 1}',
        '{"arm": {}}',
        '{"hands": {"keys": NaN}}',
        f'{{"hands": {{"number": {1 << 64}}}}}',
        pytest.param("[" * 30_000, id="nested"),
    ],
)
def test_a_page_that_sends_nonsense_is_disconnected_alone(nonsense: str | bytes) -> None:
    async def story(desk: Desk, opens: Opens) -> None:
        async with opens() as guest, opens() as page:
            await guest.send(nonsense)
            await guest.wait_closed()
            assert guest.close_code == 1008
            desk.pages.show("facts", "for who stays")
            assert await a_round(page) == ["for who stays"]

    assert [said for _, (_, said) in run(story).heard if said is not None] == []


def test_a_page_that_sends_without_end_is_disconnected() -> None:
    async def story(desk: Desk, opens: Opens) -> None:
        async with opens() as page:
            with contextlib.suppress(ConnectionClosed):
                for _ in range(1000):
                    await page.send('{"hands": {}}')
            await page.wait_closed()
            assert page.close_code == 1008
        await desk.until(lambda: desk.counts[-1] == 0)

    run(story)


def test_one_page_too_many_is_told_so_and_the_others_stay() -> None:
    async def story(desk: Desk, opens: Opens) -> None:
        async with contextlib.AsyncExitStack() as stack:
            pages = [await stack.enter_async_context(opens()) for _ in range(MOST_PAGES)]
            await desk.until(lambda: len(desk.counts) == MOST_PAGES)
            async with opens() as another:
                with pytest.raises(ConnectionClosed) as closed:
                    await another.recv()
                assert closed.value.rcvd is not None
                assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1013, f"{MOST_PAGES} pages are open")
            desk.pages.show("facts", "here")
            assert [await a_round(page) for page in pages] == [["here"]] * MOST_PAGES
            await pages[0].close()
            async with opens() as another:
                await desk.until(lambda: desk.counts[-1] == MOST_PAGES)

    run(story)


def test_a_hidden_page_counts_for_nothing_and_is_shown_nothing_but_what_lasts() -> None:
    async def story(desk: Desk, opens: Opens) -> None:
        async with opens() as hidden, opens() as seen:
            await desk.until(lambda: desk.counts == [1, 2])
            await hidden.send('{"looks":false}')
            await desk.until(lambda: desk.counts[-1] == 1)
            desk.pages.show("facts", "1")
            assert await a_round(seen) == ["1"]
            await hidden.send('{"looks":true}')
            await desk.until(lambda: desk.counts[-1] == 2)
            desk.pages.show("facts", "2")
            assert await a_round(hidden) == ["2"]

    assert run(story).counts == [1, 2, 1, 2, 1, 0]


def test_a_visible_page_is_late_by_the_age_of_its_answers_and_what_it_skips_is_counted() -> None:
    async def story(desk: Desk, opens: Opens) -> None:
        now_s = asyncio.get_running_loop().time
        async with opens() as page:
            assert desk.pages.late(now_s()) is None
            desk.pages.show("facts", "0")
            await a_round(page)
            for number in range(10):
                desk.pages.show("overview", b"%d" % number)
            late_s, skips = desk.pages.late(now_s()) or (0.0, 0.0)
            assert skips == pytest.approx(0.9)
            late_s, _ = desk.pages.late(now_s() + 1.0) or (0.0, 0.0)
            assert late_s >= 1.0  # not answered yet
            assert desk.pages.late(now_s() + 30.0) is None  # halted
            await page.send(TAKEN)
            await a_round(page)
            await page.send('{"taken":false}')
            await desk.until(lambda: desk.pages.late(now_s()) is None)  # covered by another window
            desk.pages.show("facts", "1")
            await a_round(page)
            assert desk.pages.late(now_s() + 1.0) is None
            await page.send(TAKEN)
            await desk.until(lambda: desk.pages.late(now_s()) is not None)
            await page.send('{"looks":false}')
            await desk.until(lambda: desk.counts[-1] == 0)
            assert desk.pages.late(now_s()) is None

    run(story)
