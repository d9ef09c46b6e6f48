"""A headless Chromium that a test drives over the DevTools protocol, with aiohttp alone.

    with Browser() as browser:
        page = browser.open("http://127.0.0.1:8000/")
        page.wait_for("document.title")
        page.hold("KeyW", seconds=0.5)

Every call waits for its answer. What the page logged or asked for on the way is kept in
`page.errors` and `page.requests`.

References:
    https://chromedevtools.github.io/devtools-protocol/tot/
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import itertools
import json
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any, Self

import aiohttp

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--no-first-run",
    "--no-proxy-server",
    "--disable-extensions",
    "--disable-component-update",
    "--disable-sync",
    "--disable-background-networking",
    # A page behind another one is to go on as one in front does.
    "--disable-background-timer-throttling",
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
    "--remote-debugging-port=0",
    "--remote-allow-origins=*",
)

KEYS = {  # code: key, number, text
    "Space": (" ", 32, " "),
    "Tab": ("Tab", 9, ""),
    "Enter": ("Enter", 13, "\r"),
    "Escape": ("Escape", 27, ""),
    "ArrowLeft": ("ArrowLeft", 37, ""),
    "ArrowUp": ("ArrowUp", 38, ""),
    "ArrowRight": ("ArrowRight", 39, ""),
    "ArrowDown": ("ArrowDown", 40, ""),
    "Comma": (",", 188, ","),
    "Period": (".", 190, "."),
    "ShiftLeft": ("Shift", 16, ""),
}
SHIFT = 8
"""The protocol's bit for it."""


def chromium() -> str | None:
    """The browser's command, None if there is none."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next((path for path in map(shutil.which, names) if path), None)


class Browser:
    """A running Chromium with an empty profile of its own; closes at the end of `with`."""

    def __init__(self, *, size: tuple[int, int] = (1000, 760)) -> None:
        command = chromium()
        assert command is not None, "there is no Chromium on the PATH"
        self.size = size
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            [command, *FLAGS, f"--user-data-dir={self._profile.name}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._runner = asyncio.Runner()
        self._pages: list[Page] = []
        self._web = self._runner.run(self._connected())

    async def _connected(self) -> aiohttp.ClientSession:
        """Wait for the file in which Chromium says where it listens."""
        place = Path(self._profile.name, "DevToolsActivePort")
        deadline = time.monotonic() + 60.0
        while not (place.exists() and place.read_text(encoding="utf-8").count("\n")):
            assert self._process.poll() is None, "Chromium ended at once"
            assert time.monotonic() < deadline, "Chromium does not start"
            await asyncio.sleep(0.05)
        port = place.read_text(encoding="utf-8").split()[0]
        return aiohttp.ClientSession(f"http://127.0.0.1:{port}")

    def open(self, url: str, *, before: str = "") -> Page:
        """A window of its own that shows an address.

        Args:
            url: The address.
            before: JavaScript that runs in the page before its own.
        """
        page = Page(self._runner, self._runner.run(self._opened()))
        self._pages.append(page)
        for domain in ("Page", "Runtime", "Log", "Network"):
            page.send(f"{domain}.enable")
        page.send("Emulation.setFocusEmulationEnabled", enabled=True)
        page.resize(*self.size)
        if before:
            page.send("Page.addScriptToEvaluateOnNewDocument", source=before)
        page.navigate(url)
        return page

    async def _opened(self) -> aiohttp.ClientWebSocketResponse:
        """The connection to a new window."""
        async with self._web.put("/json/new?about:blank") as answer:
            target = (await answer.json())["id"]
        return await self._web.ws_connect(
            f"/devtools/page/{target}",
            max_msg_size=0,
            timeout=aiohttp.ClientWSTimeout(ws_close=1.0),
        )

    def close(self) -> None:
        """End Chromium and delete its profile."""
        for page in self._pages:
            page.close()
        self._runner.run(self._web.close())
        self._runner.close()
        self._process.terminate()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._profile.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Page:
    """One window.

    Attributes:
        errors: What went wrong in it so far: exceptions, and errors in the console.
        requests: Addresses that it asked for so far, those of websockets too.
    """

    def __init__(self, runner: asyncio.Runner, connection: aiohttp.ClientWebSocketResponse) -> None:
        self.errors: list[str] = []
        self.requests: list[str] = []
        self._runner, self._connection = runner, connection
        self._numbers = itertools.count(1)
        self._held: list[str] = []

    # The protocol --------------------------------------------------------------------------

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """One command and its result."""
        return self._runner.run(self._sent(method, parameters))

    async def _sent(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        number = next(self._numbers)
        await self._connection.send_json({"id": number, "method": method, "params": parameters})
        while True:
            message = await self._connection.receive(timeout=60.0)
            assert message.type is aiohttp.WSMsgType.TEXT, f"Chromium hung up during {method}"
            answer = json.loads(message.data)
            if answer.get("id") == number:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]
            self._note(answer.get("method", ""), answer.get("params", {}))

    def _note(self, event: str, content: dict[str, Any]) -> None:
        """Keep what a test may ask about."""
        if event == "Network.requestWillBeSent":
            self.requests.append(content["request"]["url"])
        elif event == "Network.webSocketCreated":
            self.requests.append(content["url"])
        elif event == "Runtime.exceptionThrown":
            details = content["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif event == "Runtime.consoleAPICalled" and content["type"] in ("error", "assert"):
            self.errors.append(" ".join(str(each.get("value")) for each in content["args"]))
        elif event == "Log.entryAdded" and content["entry"]["level"] == "error":
            entry = content["entry"]
            self.errors.append(f"{entry['text']} {entry.get('url', '')}".strip())

    def close(self) -> None:
        """Close the window; a second time does nothing."""
        if not self._connection.closed:
            with contextlib.suppress(AssertionError, ConnectionError):
                self.send("Page.close")
            self._runner.run(self._connection.close())

    # Looking -------------------------------------------------------------------------------

    def navigate(self, url: str) -> None:
        """Show an address; what it needs may still be on its way."""
        self.send("Page.navigate", url=url)

    def evaluate(self, expression: str) -> Any:
        """The value of a JavaScript expression; a promise is waited for."""
        answer = self.send(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        failed = answer.get("exceptionDetails")
        assert not failed, f"{expression}: {failed.get('exception', failed).get('description')}"
        return answer["result"].get("value")

    def wait_for(self, expression: str, *, seconds: float = 60.0) -> Any:
        """Wait until an expression is true, and return its value."""
        deadline = time.monotonic() + seconds
        while not (value := self.evaluate(expression)):
            assert time.monotonic() < deadline, f"not within {seconds:g} s: {expression}"
            time.sleep(0.03)
        return value

    def resize(self, width: int, height: int, *, zoom: float = 1.0) -> None:
        """Give the window a size in device pixels, and the page a zoom as Ctrl-plus does."""
        self.send(
            "Emulation.setDeviceMetricsOverride",
            width=round(width / zoom),
            height=round(height / zoom),
            deviceScaleFactor=zoom,
            mobile=False,
        )

    def screenshot(self, path: Path, *, whole: bool = False) -> None:
        """Write what the window shows, or the whole page, as .png or .jpg."""
        kind = {"format": "png"} if path.suffix == ".png" else {"format": "jpeg", "quality": 75}
        answer = self.send("Page.captureScreenshot", captureBeyondViewport=whole, **kind)
        path.write_bytes(base64.b64decode(answer["data"]))

    # Doing ---------------------------------------------------------------------------------

    def key_down(self, code: str) -> None:
        """Press a key by its place on the keyboard, such as `KeyW`."""
        self._held.append(code)
        self._key("keyDown", code)

    def key_up(self, code: str) -> None:
        """Let a key go."""
        self._held.remove(code)
        self._key("keyUp", code)

    def _key(self, kind: str, code: str) -> None:
        letter = code.removeprefix("Key").removeprefix("Digit").lower()
        key, number, text = KEYS.get(code, (letter, ord(letter[0].upper()), letter))
        typed = {"text": text} if text and kind == "keyDown" else {}
        shift = SHIFT if "ShiftLeft" in self._held else 0
        self.send(
            "Input.dispatchKeyEvent",
            type=kind,
            code=code,
            key=key,
            windowsVirtualKeyCode=number,
            modifiers=shift,
            **typed,
        )

    def press(self, code: str, *, shift: bool = False) -> None:
        """Press a key and let it go."""
        if shift:
            self.key_down("ShiftLeft")
        self.key_down(code)
        self.key_up(code)
        if shift:
            self.key_up("ShiftLeft")

    def hold(self, code: str, *, seconds: float) -> None:
        """Hold a key down for a while."""
        self.key_down(code)
        time.sleep(seconds)
        self.key_up(code)

    def focus(self, selector: str) -> None:
        """Move the focus to an element without clicking."""
        self.place(selector)
        self.evaluate(f"document.querySelector({json.dumps(selector)}).focus()")

    def type(self, text: str) -> None:
        """Put text where the focus is."""
        self.send("Input.insertText", text=text)

    def place(self, selector: str, *, x: float = 0.5, y: float = 0.5) -> tuple[float, float]:
        """A point of an element [CSS px], by its shares of width and height, scrolled into view."""
        found = self.evaluate(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)}); if (!e) return;"
            " e.scrollIntoView({block: 'nearest', behavior: 'instant'});"
            " const b = e.getBoundingClientRect();"
            " return [b.left, b.top, b.width, b.height]; })()"
        )
        assert found, f"the page has no {selector}"
        left, top, width, height = found
        assert width and height, f"{selector} has no size"
        return left + x * width, top + y * height

    def click(self, selector: str, *, x: float = 0.5, y: float = 0.5) -> None:
        """Click into an element."""
        self.drag(self.place(selector, x=x, y=y), (0.0, 0.0))

    def drag(self, start: tuple[float, float], by: tuple[float, float], *, steps: int = 4) -> None:
        """Press the left button at a point, move it by some pixels, let it go."""
        (x, y), (dx, dy) = start, by
        self._mouse("mouseMoved", x, y)
        self._mouse("mousePressed", x, y, buttons=1, clickCount=1)
        for step in range(1, steps + 1) if any(by) else ():
            share = step / steps
            self._mouse("mouseMoved", x + share * dx, y + share * dy, buttons=1)
        self._mouse("mouseReleased", x + dx, y + dy, clickCount=1)

    def _mouse(self, kind: str, x: float, y: float, **more: int) -> None:
        button = "none" if kind == "mouseMoved" and not more else "left"
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, **more)

    def choose(self, selector: str, value: object) -> None:
        """Give a slider, a field or a list a value as a user's hand would, events included."""
        self.place(selector)
        self.evaluate(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)}); e.focus();"
            f" e.value = {json.dumps(str(value))};"
            " for (const name of ['input', 'change'])"
            " e.dispatchEvent(new Event(name, {bubbles: true})); })()"
        )
