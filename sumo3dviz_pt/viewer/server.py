"""The viewer's web server in a thread of its own, on this machine only.

It listens on 127.0.0.1; a tunnel such as `ssh -L` brings it elsewhere. It answers requests for its
page, its websocket and its stills. Others who have an account on the machine could reach the
server, too, and so could web pages that the user visits: hence a token in the address, and a look
at the headers Host (DNS rebinding) and Origin (foreign pages). Nothing is ever fetched from
outside, and the page cannot either.

References:
    RFC 6455, sections 7.4 (close codes) and 10.2 (origin); W3C, Content Security Policy 3.
"""

from __future__ import annotations

import asyncio
import errno
import hmac
import json
import os
import re
import secrets
import signal
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.errors import ConfigError, MissingExtraError
from sumo3dviz_pt.viewer.client import Outbox
from sumo3dviz_pt.viewer.messages import Frame, Note

if TYPE_CHECKING:
    from sumo3dviz_pt.viewer.render_thread import RenderThread


try:
    from aiohttp import WSCloseCode, WSMsgType
    from aiohttp import web as web
except ImportError as error:
    raise MissingExtraError("the viewer needs aiohttp", extra="viewer") from error

if TYPE_CHECKING:
    from sumo3dviz_pt.viewer.client import Client


HOST = "127.0.0.1"
_OWN_NAME = re.compile(r"(localhost|127\.0\.0\.1|\[::1\])(:\d{1,5})?", re.I)
_KINDS = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
_LONGEST_ORDER = 1 << 16  # bytes
_HEARTBEAT = 30.0  # s; notices a line that is cut
PATIENCE = 2.0  # s for the pages to say goodbye
_POLICY = (
    "default-src 'self'; img-src 'self' blob: data:; connect-src 'self' ws://{host};"
    " frame-ancestors 'self' http://localhost:* http://127.0.0.1:*;"
    " base-uri 'none'; form-action 'none'; object-src 'none'"
)
_HEADERS = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Server": "sumo3dviz_pt",
}
_NOT_HERE = (
    "There is nothing at this address.\n\n"
    "The viewer's address holds a token that changes whenever the viewer starts:"
    " open the address that it printed last.\n"
)


@dataclass(frozen=True, slots=True)
class _PageFile:
    """A file of the page.

    Attributes:
        text: Its content.
        kind: Its content type.
    """

    text: str
    kind: str


@dataclass(frozen=True, slots=True, eq=False)
class _RouteContext:
    """What the routes need.

    Attributes:
        render_thread: What renders.
        token: The secret in the address.
        proxied: Whether a notebook server passes pages' requests on, under its own name.
        files: The page's files, by name.
        talks: Open conversations.
    """

    render_thread: RenderThread
    token: str
    proxied: bool
    files: Mapping[str, _PageFile]
    talks: set[web.WebSocketResponse]


_SITE = web.AppKey("site", _RouteContext)


def application(
    render_thread: RenderThread, token: str, *, proxied: bool = False
) -> web.Application:
    """Make the routes `/TOKEN/`, its files, `/TOKEN/ws` and `/TOKEN/stills/N.png`.

    Args:
        render_thread: What renders.
        token: The secret in the address.
        proxied: Whether a notebook server passes pages' requests on, under its own name.
    """
    made = web.Application(middlewares=[_guarded])
    made[_SITE] = _RouteContext(render_thread, token, proxied, _page_files(), set())
    made.on_response_prepare.append(_sign)
    made.on_shutdown.append(_say_goodbye)
    for path, handler in (
        ("/{token}", _to_page),
        ("/{token}/", _file),
        ("/{token}/ws", _talk),
        (r"/{token}/stills/{number:\d{1,6}}.png", _still),
        ("/{token}/{name}", _file),
    ):
        made.router.add_get(path, handler, allow_head=False)
    return made


# Which requests are answered ---------------------------------------------------------------


@web.middleware
async def _guarded(
    request: web.Request, handler: Callable[[web.Request], Any]
) -> web.StreamResponse:
    """Answer only requests to our own name, from our own page, with the token."""
    host, origin = request.headers.get("Host", ""), request.headers.get("Origin")
    proxied = request.app[_SITE].proxied
    if not (_OWN_NAME.fullmatch(host) or proxied):
        raise web.HTTPForbidden(text="The viewer answers to localhost and 127.0.0.1 only.\n")
    # A notebook server may talk to browsers by https, though it talks to us by http.
    pages = {f"http://{host}".lower(), *([f"https://{host}".lower()] if proxied else ())}
    if origin is not None and origin.lower() not in pages:
        raise web.HTTPForbidden(text="The viewer does not talk to other pages.\n")
    # `OPTIONS *` has no slash; a path may hold bytes that are no text.
    token = request.path.partition("/")[2].partition("/")[0].encode(errors="replace")
    if not hmac.compare_digest(token, request.app[_SITE].token.encode()):
        raise web.HTTPNotFound(text=_NOT_HERE)
    if request.match_info.http_exception is not None and request.method == "GET":
        raise web.HTTPNotFound(text=_NOT_HERE)
    answer: web.StreamResponse = await handler(request)
    return answer


async def _sign(request: web.Request, response: web.StreamResponse) -> None:
    """Add what tells the browser to be strict."""
    response.headers.update(_HEADERS)
    host = request.headers.get("Host", "")
    own = host if _OWN_NAME.fullmatch(host) else HOST
    response.headers["Content-Security-Policy"] = _POLICY.format(host=own)


# What is answered --------------------------------------------------------------------------


async def _to_page(request: web.Request) -> web.StreamResponse:
    """Lead to the page's address with a slash at its end: the page's files lie below it."""
    raise web.HTTPPermanentRedirect(f"{request.app[_SITE].token}/")


async def _file(request: web.Request) -> web.StreamResponse:
    name = request.match_info.get("name", "index.html")
    if name not in request.app[_SITE].files:
        raise web.HTTPNotFound(text=_NOT_HERE)
    file = request.app[_SITE].files[name]
    return web.Response(text=file.text, content_type=file.kind, charset="utf-8")


async def _still(request: web.Request) -> web.StreamResponse:
    picture = request.app[_SITE].render_thread.still(int(request.match_info["number"]))
    if picture is None:
        raise web.HTTPNotFound(text="There is no such still.\n")
    return web.Response(body=picture, content_type="image/png")


async def _talk(request: web.Request) -> web.StreamResponse:
    """Hold the conversation with one page until either side ends it."""
    talk = web.WebSocketResponse(
        heartbeat=_HEARTBEAT, max_msg_size=_LONGEST_ORDER, compress=False, timeout=PATIENCE
    )
    await talk.prepare(request)
    request.app[_SITE].talks.add(talk)
    outbox = Outbox(asyncio.get_running_loop())
    client = request.app[_SITE].render_thread.join(outbox.deliver)
    sending = asyncio.create_task(_send(talk, outbox))
    try:
        async for message in talk:
            if message.type is WSMsgType.TEXT:
                _hear(message.data, client, outbox)
    finally:
        client.leave()
        sending.cancel()
        request.app[_SITE].talks.discard(talk)
    return talk


async def _send(talk: web.WebSocketResponse, outbox: Outbox) -> None:
    """Pass on what is delivered; a line that breaks ends the conversation elsewhere."""
    with suppress(ConnectionResetError):
        while True:
            message = await outbox.following()
            if isinstance(message, Frame):
                await talk.send_json(message.info)
                await talk.send_bytes(message.jpeg)
            else:
                await talk.send_json(message.content)


def _hear(text: str, client: Client, outbox: Outbox) -> None:
    """Pass on what a page says; nonsense is answered with a note."""
    try:
        message = _parsed(text)
        if "ack" not in message:
            client.order(message)
        elif outbox.acknowledge(message["ack"]):
            client.acknowledge(message["ack"])
    except ConfigError as error:
        outbox.deliver(Note({"kind": "note", "level": "error", "text": str(error)}))


def _parsed(text: str) -> dict[str, Any]:
    """Return a page's message.

    Raises:
        ConfigError: If it is no JSON object.
    """
    try:
        message = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"not understood: {text[:80]!r} is no JSON") from error
    if not isinstance(message, dict):
        raise ConfigError(f"not understood: {text[:80]!r} is no JSON object")
    return message


async def _say_goodbye(app: web.Application) -> None:
    """Close all conversations; the pages show the reason and wait for our return."""
    goodbyes = [
        talk.close(code=WSCloseCode.GOING_AWAY, message=b"The viewer was stopped.")
        for talk in set(app[_SITE].talks)
    ]
    await asyncio.gather(*goodbyes)


def _page_files() -> dict[str, _PageFile]:
    """Read the page's files, by name."""
    folder = resources.files("sumo3dviz_pt.viewer") / "page"
    return {
        file.name: _PageFile(file.read_text(encoding="utf-8"), _KINDS[Path(file.name).suffix])
        for file in folder.iterdir()
    }


_TOKEN = re.compile(r"[\w-]{1,200}", re.A)


class Server:
    """A viewer in a thread of its own, until it is closed. Use in a `with` statement.

    Args:
        render_thread: What renders; started and closed along with the server.
        port: To listen on; 0 takes a free one. Or a socket of `listening`.
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
        port: int | socket.socket = 0,
        token: str | None = None,
        proxied: bool = False,
    ) -> None:
        token = secrets.token_urlsafe(16) if token is None else token
        if not _TOKEN.fullmatch(token):
            raise ConfigError("1..200 letters, digits, - or _ are allowed", key="token")
        self._render_thread = render_thread
        self._application = application(render_thread, token, proxied=proxied)
        self._listening = port if isinstance(port, socket.socket) else listening(port)
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
    render_thread: RenderThread,
    *,
    port: int | socket.socket,
    token: str | None,
    announce: Callable[[str], None],
) -> None:
    """Show a render thread's scene until Ctrl-C or SIGTERM.

    Args:
        render_thread: What renders; started and closed here.
        port: To listen on; 0 takes a free one. Or a socket of `listening`.
        token: The secret in the address; None makes one up.
        announce: Told the page's address as soon as it answers.

    Raises:
        ConfigError: If the port is taken or the token does not suit an address.
        Sumo3dvizError: If the scene cannot be built or rendered.
    """
    over = threading.Event()
    # The signals are restored first, so that a second Ctrl-C ends the program at once.
    with Server(render_thread, port=port, token=token) as server, _on_signals(lambda _: over.set()):
        announce(server.address)
        while server.running and not over.wait(0.5):
            pass


def listening(port: int, *, key: str = "port") -> socket.socket:
    """Return a socket on this machine's own interface.

    Args:
        port: To listen on; 0 takes a free one.
        key: How the port was asked for, for messages.

    Raises:
        ConfigError: If the port is taken, or not ours to take.
    """
    if not 0 <= port < 1 << 16:
        raise ConfigError(f"must lie in 0..65535, not {port}", key=key)
    try:
        return socket.create_server((HOST, port))
    except OSError as error:
        taken = error.errno == errno.EADDRINUSE
        why = "is in use" if taken else f"cannot be used ({os.strerror(error.errno or 0)})"
        text = f"port {port} {why}; choose another, or leave it out"
        raise ConfigError(text, key=key) from error


@contextmanager
def heeded_signals() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end what goes on, and what is to be put away be put away.

    A shell's script starts programs in the background so that they ignore Ctrl-C.

    Raises:
        KeyboardInterrupt: At Ctrl-C.
        SystemExit: At SIGTERM.
    """

    def end(which: int) -> None:
        raise KeyboardInterrupt if which == signal.SIGINT else SystemExit(128 + which)

    with _on_signals(end):
        yield


@contextmanager
def _on_signals(act: Callable[[int], None]) -> Iterator[None]:
    """Do something on Ctrl-C and SIGTERM; only the main thread is told of them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def on_signal(number: int, _frame: FrameType | None) -> None:
        act(number)

    before = {which: signal.signal(which, on_signal) for which in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for which, handler in before.items():
            signal.signal(which, handler)
