"""Feeds pictures to two writers at once: finishing them costs more than encoding them twice."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from queue import Full, Queue
from typing import Any

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.model.geometry import Image

Writer = Callable[[Iterable[Image]], Any]

_AHEAD = 2  # pictures that the first writer may be ahead of the second
_PATIENCE = 0.5  # after which it is asked whether the second has failed [s]

_Handed = Image | BaseException | None


def write_both(pictures: Iterable[Image], first: Writer, second: Writer) -> None:
    """Hand every picture to two writers, in memory that does not grow.

    Args:
        pictures: Each is made once.
        first: Takes them all, here.
        second: Takes them all, in a thread of its own.

    Raises:
        Exception: What a writer raises; the other one is stopped by an error, too, so that neither
            leaves half a film.
    """
    handed: Queue[_Handed] = Queue(maxsize=_AHEAD)
    with ThreadPoolExecutor(max_workers=1) as pool:
        twin = pool.submit(second, _taken(handed))
        try:
            first(_handing(pictures, handed, twin))
        except BaseException:
            _put(handed, RenderError("the film beside it failed"), twin)
            raise
        _put(handed, None, twin)
        twin.result()


def _taken(handed: Queue[_Handed]) -> Iterator[Image]:
    """Yield what is handed over, until its end."""
    while (item := handed.get()) is not None:
        if isinstance(item, BaseException):
            raise item
        yield item


def _handing(
    pictures: Iterable[Image], handed: Queue[_Handed], twin: Future[Any]
) -> Iterator[Image]:
    """Yield pictures and hand each over."""
    for picture in pictures:
        _put(handed, picture, twin)
        if twin.done():
            twin.result()
            raise RenderError("the film without overlays ended too early")
        yield picture


def _put(handed: Queue[_Handed], item: _Handed, twin: Future[Any]) -> None:
    """Hand something over, unless nobody takes it any more."""
    while not twin.done():
        try:
            handed.put(item, timeout=_PATIENCE)
            return
        except Full:
            continue
