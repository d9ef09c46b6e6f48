"""What waits to be sent to one page: back pressure by acknowledgement.

A page says when it has shown a picture. Until then no other one is on its way, and of
those that are made meanwhile only the newest is kept: a slow line sees fewer pictures,
never old ones. Notes are short and rare; all of them arrive, in their order.
"""

from __future__ import annotations

import asyncio
from collections import deque

from sumo3dviz_pt.viewer.messages import Frame, Message, Note


class Outbox:
    """Filled from the render thread, emptied in the server's event loop.

    Args:
        loop: In which `following` and `acknowledge` are called.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._notes: deque[Note] = deque()
        self._frame: Frame | None = None
        self._under_way: int | None = None
        self._news = asyncio.Event()

    def deliver(self, message: Message) -> None:
        """Leave a message; from any thread, never waits."""
        self._loop.call_soon_threadsafe(self._put, message)

    def acknowledge(self, seq: int) -> bool:
        """Hear that a picture is shown; whether it was the one under way."""
        if seq != self._under_way:
            return False
        self._under_way = None
        self._news.set()
        return True

    async def following(self) -> Message:
        """Wait for the next message that may be sent; a picture is under way from now on."""
        while True:
            if self._notes:
                return self._notes.popleft()
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
            self._notes.append(message)
        self._news.set()
