"""One page's visit: its orders, its last picture, and when it can take the next one."""

from __future__ import annotations

import threading
import time as clock
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sumo3dviz_pt.job.settings import KeyFrame
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.viewer.mean import Mean
from sumo3dviz_pt.viewer.messages_in import Order, parsed
from sumo3dviz_pt.viewer.messages_out import Frame, Message, Note
from sumo3dviz_pt.viewer.state import ViewerState

_MOST_ORDERS = 20_000
"""Orders that may wait, while a still is taken; beyond that the oldest are dropped."""


@dataclass(frozen=True, slots=True, eq=False)
class Pictured:
    """What a page's last picture shows.

    Attributes:
        time: SUMO's [s].
        view: The camera.
        dynamic: Whether road users are in it.
        shot: The built scene that it was taken of.
    """

    time: float
    view: View
    dynamic: bool
    shot: object


class Client:
    """A page that looks at the scene. Orders come from the server's thread.

    Only the render thread changes the attributes.

    Attributes:
        state: Place, time and switches.
        mean: Samples of the picture that is shown, or None.
        parts: Parts of the next sample of a large picture that are done.
        began: When the first of them was begun [s].
        pictured: What the last picture shows, or None.
        ticked: Until when time has passed for this page [s]; None while nothing happens.
        told: The key frames that the page was told of.
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
        self.pictured: Pictured | None = None
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
        """Note that the page shows a picture, and can take the next."""
        with self._lock:
            self._acknowledged = max(self._acknowledged, seq)
        self._wake()

    def leave(self) -> None:
        """End the visit: the page is gone."""
        self._leave(self)

    def taken(self) -> list[tuple[float, Order]]:
        """Return all orders since the last call, each with the time at which it came [s]."""
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
    def has_orders(self) -> bool:
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
