"""Windows of a running simulation, made ready in a thread of their own while pages are served.

The simulation goes on as far as the pages that play come, and a little further. A window is made
ready as a whole: traffic, signals and bodies. The render thread puts it in place between two
pictures, so that no picture mixes two windows.
"""

from __future__ import annotations

import logging
import threading
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf
from typing import Any, Protocol

from sumo3dviz_pt.errors import ConfigError, Sumo3dvizError
from sumo3dviz_pt.pipeline.live import Ground, Live, Window

log = logging.getLogger(__name__)

LEAD = 4.0
"""A window reaches at least so far beyond what pages show, and twice as far as is shown while it
is made, as a window of 5 s takes as much work as one of 30 s [s of playing]."""

_FARTHEST = 30.0
"""But not farther [s]: what pages show has to lie in it."""

_IDLE = 0.1
"""Time until it is looked again whether a window is wanted [s]."""

_PATIENCE = 10.0
"""Time that a simulation has for its current step when the viewer ends [s]."""

_SHARE = 0.25
"""Share of the time that windows of somebody's loop may take, so that pictures have the rest."""


class Feed(Protocol):
    """Where windows come from."""

    @property
    def stopped(self) -> str:
        """Why nothing more comes; empty while something may."""

    @property
    def trouble(self) -> str:
        """What went wrong with the simulation; empty while it is well."""

    def advance(self, until: float) -> Ground | None:
        """Return a window in which a time can be shown [s]; None if there is nothing new."""


@dataclass(frozen=True, slots=True, eq=False)
class Running:
    """A simulation that runs while it is looked at.

    Attributes:
        ground: What was read of it beforehand; the scene is built for that, if anybody is there.
        feed: Where its windows come from.
        title: Its name.
    """

    ground: Ground
    feed: Feed
    title: str = "sumo3dviz_pt"


_MOST_NAMED = 200
"""Road users that a page is told of, at most."""


def span_said(ground: Ground, *, trouble: str = "") -> dict[str, Any]:
    """Write what there is to see of a running simulation as messages to pages hold it.

    Args:
        ground: Its window.
        trouble: What went wrong with it; empty while it is well.
    """
    there = [
        each
        for each in ground.trajectories
        if each.pieces and each.pieces[0].begin <= ground.end <= each.pieces[-1].end
    ]
    there.sort(key=lambda each: -each.pieces[0].begin)
    return {
        "begin": ground.begin,
        "end": ground.end,
        "running": ground.growing,
        "trouble": trouble,
        "users": [each.id for each in there[:_MOST_NAMED]],
    }


@dataclass(frozen=True, slots=True, eq=False)
class News:
    """A window that is ready.

    Attributes:
        window: What it shows.
        stopped: Why it is the last one; empty if it is not.
        level: Of the note on that, `info` or `error`.
    """

    window: Window
    stopped: str
    level: str = "info"


def first_ground(running: Running, closing: Callable[[], bool]) -> Ground | None:
    """Wait for the first window of a simulation; None if nobody waits any more.

    Args:
        running: The simulation.
        closing: Tells whether nobody waits any more.

    Raises:
        ConfigError: If it ends before there is anything to show; has its words.
        InputError: If a row of its log is damaged.
    """
    while not closing():
        ground = running.feed.advance(2.0 * LEAD)
        if ground is not None:
            return ground
        if running.feed.stopped:
            text = f"{running.feed.stopped}, before there was anything to show"
            raise ConfigError(text, key="simulation")
    return None


class WindowThread:
    """Makes windows ready until it is closed.

    Args:
        feed: Where they come from.
        live: The open scene.
        wake: Called when a window is ready.
    """

    def __init__(self, feed: Feed, live: Live, *, wake: Callable[[], None]) -> None:
        self._feed, self._live, self._wake = feed, live, wake
        self._ready: News | None = None
        self._shown, self._speed, self._cost = live.ground.begin, 1.0, 0.0
        self._changed = threading.Condition()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="windows", daemon=True)
        self._thread.start()

    def follow(self, shown: float, *, speed: float) -> None:
        """Note how far pages are.

        Args:
            shown: The latest time that one shows [s].
            speed: The fastest that one plays at.
        """
        self._shown, self._speed = shown, speed

    def taken(self) -> News | None:
        """Return the window that is ready, if there is one; the next one is begun then."""
        with self._changed:
            ready, self._ready = self._ready, None
            self._changed.notify_all()
        return ready

    def close(self) -> None:
        """End it."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(_PATIENCE)

    def _run(self) -> None:
        """Make one window after the other."""
        end = self._live.ground.end
        while not self._closing:
            speed, began = max(self._speed, 1.0), clock.perf_counter()
            spare = max(LEAD, 2.0 * self._cost) * speed
            reach = min(max(2.0 * LEAD, 2.0 * spare), _FARTHEST)
            news = self._made(self._shown + reach) if self._shown + spare > end else None
            if news is None:
                self._pause(_IDLE)
                continue
            end, self._cost = news.window.ground.end, clock.perf_counter() - began
            with self._changed:
                self._ready = news
            self._wake()
            if news.window.ground.behind < inf:  # the next one is wanted at once
                self._pause(self._cost * (1.0 / _SHARE - 1.0))
            with self._changed:
                self._changed.wait_for(lambda: self._ready is None or self._closing)
            if news.stopped:
                return

    def _made(self, until: float) -> News | None:
        """Return a window in which a time can be shown [s], or None."""
        try:
            ground = self._feed.advance(until)
            if ground is None:
                return None
            level = "error" if self._feed.trouble else "info"
            return News(self._live.carried_on(ground), self._feed.stopped, level)
        except Exception as error:
            # What is there stays, and pages are told why nothing more comes.
            if not isinstance(error, Sumo3dvizError):
                log.exception("a window of the simulation failed")
            live = self._live
            last = Window(replace(live.ground, growing=False), live.shot, live.shot.data)
            return News(last, f"no more can be shown: {error}", "error")

    def _pause(self, seconds: float) -> None:
        """Wait for some time, or until the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._closing, timeout=seconds)
