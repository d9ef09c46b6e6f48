"""The viewer's web server in a thread of its own, on this machine only.

It listens on 127.0.0.1; a tunnel such as `ssh -L` brings it elsewhere. What it answers, and to
whom, stands in `routes`.
"""

from __future__ import annotations

import asyncio
import re
import secrets
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.viewer.routes import HOST, PATIENCE, application, web

if TYPE_CHECKING:
    from sumo3dviz_pt.viewer.render_thread import RenderThread

_TOKEN = re.compile(r"[\w-]{1,200}", re.A)


class Server:
    """A viewer in a thread of its own, until it is closed. Use in a `with` statement.

    Args:
        render_thread: What renders; started and closed along with the server.
        port: To listen on; 0 takes a free one.
        token: The secret in the address; None makes one up.
        proxied: Whether a notebook server passes pages' requests on, under its own name.

    Attributes:
        address: Of the page.

    Raises:
        ConfigError: If the port is taken or the token does not suit an address.
    """

    def __init__(
        self,
        render_thread: RenderThread,
        *,
        port: int = 0,
        token: str | None = None,
        proxied: bool = False,
    ) -> None:
        token = secrets.token_urlsafe(16) if token is None else token
        if not _TOKEN.fullmatch(token):
            raise ConfigError("1..200 letters, digits, - or _ are allowed", key="token")
        self._render_thread = render_thread
        self._application = application(render_thread, token, proxied=proxied)
        self._listening = _listen(port)
        self._stop, self._end, self._parted = asyncio.Event(), asyncio.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="viewer", daemon=True)
        self.address = f"http://{HOST}:{self._listening.getsockname()[1]}/{token}/"

    def start(self) -> None:
        """Open the scene, which may take a minute, and answer from then on.

        Raises:
            Sumo3dvizError: If the scene cannot be built or rendered.
        """
        try:
            self._render_thread.start()
        except BaseException:
            self._listening.close()
            raise
        self._loop = asyncio.new_event_loop()
        self._thread.start()

    def close(self) -> None:
        """Say goodbye to the pages, stop rendering, wait for both; a second time does nothing."""
        if self.running:
            self._tell(self._stop)
            self._parted.wait()
        # Not in a thread of the loop: while the interpreter ends, no thread can be started.
        self._render_thread.close()
        if self.running:
            self._tell(self._end)
            self._thread.join()
        self._listening.close()

    def _tell(self, event: asyncio.Event) -> None:
        """Set an event of the loop's."""
        with suppress(RuntimeError):  # it ended by itself just now
            self._loop.call_soon_threadsafe(event.set)

    @property
    def running(self) -> bool:
        """Whether pages are answered."""
        return self._thread.is_alive()

    def __enter__(self) -> Server:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
                runner.run(self._answer())
        finally:
            self._parted.set()

    async def _answer(self) -> None:
        runner = web.AppRunner(self._application, access_log=None, shutdown_timeout=PATIENCE)
        await runner.setup()
        try:
            await web.SockSite(runner, self._listening).start()
            await self._stop.wait()
        finally:
            await runner.cleanup()
        self._parted.set()
        # The loop goes on until the render thread is closed, which may still deliver messages.
        await self._end.wait()


def serve(
    render_thread: RenderThread, *, port: int, token: str | None, announce: Callable[[str], None]
) -> None:
    """Show a render thread's scene until Ctrl-C or SIGTERM.

    Args:
        render_thread: What renders; started and closed here.
        port: To listen on; 0 takes a free one.
        token: The secret in the address; None makes one up.
        announce: Told the page's address as soon as it answers.

    Raises:
        ConfigError: If the port is taken or the token does not suit an address.
        Sumo3dvizError: If the scene cannot be built or rendered.
    """
    asked = threading.Event()
    # The signals are restored first, so that a second Ctrl-C ends the program at once.
    with Server(render_thread, port=port, token=token) as server, _on_signals(asked.set):
        announce(server.address)
        while server.running and not asked.wait(0.5):
            pass


def _listen(port: int) -> socket.socket:
    """Return a socket on this machine's own interface.

    Raises:
        ConfigError: If the port is taken, or not ours to take.
    """
    if not 0 <= port < 1 << 16:
        raise ConfigError(f"must lie in 0..65535, not {port}", key="port")
    try:
        return socket.create_server((HOST, port))
    except OSError as error:
        raise ConfigError(f"cannot listen on port {port}: {error}", key="port") from error


@contextmanager
def _on_signals(act: Callable[[], None]) -> Iterator[None]:
    """Do something on Ctrl-C and SIGTERM; only the main thread is told of them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def told(_number: int, _frame: FrameType | None) -> None:
        act()

    before = {which: signal.signal(which, told) for which in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for which, handler in before.items():
            signal.signal(which, handler)
