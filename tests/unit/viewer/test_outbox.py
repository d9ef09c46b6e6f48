import asyncio
from collections.abc import Awaitable, Callable

from sumo3dviz_pt.viewer.client import MOST_NOTES, Outbox
from sumo3dviz_pt.viewer.messages import Frame, Message, Note


def frame(seq: int) -> Frame:
    return Frame({"kind": "frame", "seq": seq}, b"jpeg")


def note(text: str) -> Note:
    return Note({"kind": "note", "text": text})


def run(work: Callable[[Outbox], Awaitable[None]]) -> None:
    async def whole() -> None:
        await work(Outbox(asyncio.get_running_loop()))

    asyncio.run(whole())


async def waiting(outbox: Outbox) -> list[Message]:
    """All that may be sent now."""
    found = []
    while True:
        try:
            found.append(await asyncio.wait_for(outbox.following(), 0.02))
        except TimeoutError:
            return found


def test_one_picture_is_under_way_and_the_newest_replaces_a_waiting_one() -> None:
    async def work(outbox: Outbox) -> None:
        outbox.deliver(frame(1))
        assert await waiting(outbox) == [frame(1)]
        for seq in (2, 3, 4):
            outbox.deliver(frame(seq))
        assert await waiting(outbox) == []
        assert outbox.acknowledge(1)
        assert await waiting(outbox) == [frame(4)]

    run(work)


def test_only_the_picture_under_way_can_be_acknowledged() -> None:
    async def work(outbox: Outbox) -> None:
        assert not outbox.acknowledge(1)
        outbox.deliver(frame(1))
        await waiting(outbox)
        outbox.deliver(frame(2))
        for nonsense in (0, 2, None, "1", [1]):
            assert not outbox.acknowledge(nonsense)
        assert await waiting(outbox) == []
        assert outbox.acknowledge(1)
        assert not outbox.acknowledge(1)
        assert await waiting(outbox) == [frame(2)]

    run(work)


def test_no_note_is_lost_while_a_picture_is_under_way() -> None:
    async def work(outbox: Outbox) -> None:
        outbox.deliver(frame(1))
        await waiting(outbox)
        notes = [note(str(number)) for number in range(50)]
        for each in notes:
            outbox.deliver(each)
            outbox.deliver(frame(2))
        assert await waiting(outbox) == notes

    run(work)


def test_who_does_not_read_gets_the_newest_notes_only() -> None:
    async def work(outbox: Outbox) -> None:
        for number in range(MOST_NOTES + 50):
            outbox.deliver(note(str(number)))
        found = await waiting(outbox)
        assert found == [note(str(number)) for number in range(50, MOST_NOTES + 50)]

    run(work)


def test_another_thread_wakes_who_waits() -> None:
    async def work(outbox: Outbox) -> None:
        waits = asyncio.create_task(outbox.following())
        await asyncio.sleep(0)
        await asyncio.to_thread(outbox.deliver, note("here"))
        assert await asyncio.wait_for(waits, 1.0) == note("here")

    run(work)
