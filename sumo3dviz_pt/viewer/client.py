"""One page's visit: what it asked for, what it saw last, and when it can take more."""

from __future__ import annotations

import threading
import time as clock
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from sumo3dviz_pt.job.settings import KeyFrame
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.viewer.mean import Mean
from sumo3dviz_pt.viewer.messages_in import Order, parsed
from sumo3dviz_pt.viewer.messages_out import Frame, Message, Note
from sumo3dviz_pt.viewer.state import ViewerState

_MOST_ORDERS = 20_000
"""Of those that wait longer, while a still is taken, the oldest are forgotten."""


class Client:
    """A page that looks at the scene. Orders come from the server's thread.

    What the render thread alone changes: `state`, `mean`, `parts`, `began`, `pictured`, `ticked`,
    `told`, the key frames that the page knows.
    """

    def __init__(
        self,
        state: ViewerState,
        deliver: Callable[[Message], None],
        *,
        wake: Callable[[], None],
        leave: Callable[[Client], None],
    ) -> None:
        """Begin a visit.

        Args:
            state: Where it begins.
            deliver: Takes what the page is told.
            wake: Called when there is something to do.
            leave: Called at the end of the visit.
        """
        self.state = state
        self.mean: Mean | None = None
        self.parts: list[Layers] = []
        self.began = 0.0
        self.pictured: tuple[Any, ...] | None = None
        self.ticked: float | None = None
        self.told: tuple[KeyFrame, ...] = state.frames
        self._deliver, self._wake, self._leave = deliver, wake, leave
        self._lock = threading.Lock()
        self._orders: deque[tuple[float, Order]] = deque(maxlen=_MOST_ORDERS)
        self._sent = self._acknowledged = 0

    def order(self, order: Mapping[str, Any]) -> None:
        """Take a page's message.

        Raises:
            ConfigError: If it is no order.
        """
        wanted = parsed(order)
        with self._lock:
            self._orders.append((clock.perf_counter(), wanted))
        self._wake()

    def acknowledge(self, seq: int) -> None:
        """The page shows a picture, and can take the next."""
        with self._lock:
            self._acknowledged = max(self._acknowledged, seq)
        self._wake()

    def leave(self) -> None:
        """The page is gone."""
        self._leave(self)

    def taken(self) -> list[tuple[float, Order]]:
        """All orders since the last call, each with the time at which it came [s]."""
        with self._lock:
            orders = list(self._orders)
            self._orders.clear()
        return orders

    @property
    def ready(self) -> bool:
        """Whether the page shows what it was sent last."""
        with self._lock:
            return self._acknowledged >= self._sent

    @property
    def asks(self) -> bool:
        """Whether orders wait."""
        with self._lock:
            return bool(self._orders)

    def send(self, info: Mapping[str, Any], jpeg: bytes) -> None:
        """Send a picture."""
        with self._lock:
            self._sent += 1
            seq = self._sent
        self._deliver(Frame({"kind": "frame", "seq": seq, **info}, jpeg))

    def tell(self, kind: str, **content: Any) -> None:
        """Tell the page something."""
        self._deliver(Note({"kind": kind, **content}))

    def warn(self, text: object) -> None:
        """Tell the page what went wrong."""
        self.tell("note", level="error", text=str(text))
