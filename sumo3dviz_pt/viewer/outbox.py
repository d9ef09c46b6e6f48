"""Messages that wait to be sent to one page, with back pressure by acknowledgement.

A page says when it has shown a picture. Until then no other one is on its way, and of
those that are made meanwhile only the newest is kept: a slow line sees fewer pictures,
never old ones. Notes arrive in their order; of those that say how things stand now, such as
all key frames, a newer one replaces one that still waits.
"""

from __future__ import annotations

import asyncio
from typing import Any

from sumo3dviz_pt.viewer.messages_out import Frame, Message, Note

_STANDS = frozenset({"scene", "busy", "keyframes"})
"""Kinds of notes of which only the newest matters."""

MOST_NOTES = 1000
"""Notes that may wait; beyond that the oldest are lost."""


class Outbox:
    """A queue that the render thread fills and the server's event loop empties.

    Args:
        loop: In which `following` and `acknowledge` are called.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._notes: list[Note] = []
        self._frame: Frame | None = None
        self._under_way: int | None = None
        self._news = asyncio.Event()

    def deliver(self, message: Message) -> None:
        """Leave a message; from any thread, never waits."""
        self._loop.call_soon_threadsafe(self._put, message)

    def acknowledge(self, seq: Any) -> bool:
        """Note that a picture is shown; return whether it was the one under way.

        Args:
            seq: The picture's number as the page gives it, which may be anything.
        """
        if self._under_way is None or type(seq) is not int or seq != self._under_way:
            return False
        self._under_way = None
        self._news.set()
        return True

    async def following(self) -> Message:
        """Wait for the next message that may be sent; a picture is under way from now on."""
        while True:
            if self._notes:
                return self._notes.pop(0)
            if self._frame is not None and self._under_way is None:
                frame, self._frame = self._frame, None
                self._under_way = frame.info["seq"]
                return frame
            self._news.clear()
            await self._news.wait()

    def _put(self, message: Message) -> None:
        if isinstance(message, Frame):
            self._frame = message
        else:
            kind = _kind(message)
            if kind in _STANDS:
                self._notes = [note for note in self._notes if _kind(note) != kind]
            self._notes.append(message)
            del self._notes[:-MOST_NOTES]
        self._news.set()


def _kind(note: Note) -> str:
    """Return what a note is about."""
    return str(note.content["kind"])
