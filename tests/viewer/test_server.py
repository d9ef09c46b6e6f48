"""The viewer's server: who is let in, what is answered, how pictures are paced, how it ends."""

from __future__ import annotations

import asyncio
import io
import json
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import aiohttp
import pytest
from aiohttp.test_utils import TestClient, TestServer
from builders import write_scenario
from PIL import Image

from sumo3dviz_pt.errors import ConfigError, Sumo3dvizError
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.viewer.render_thread import RenderThread
from sumo3dviz_pt.viewer.server import Server, application

TOKEN = "open-sesame"
SIZE = (64, 36)
NONSENSE = (
    *("", "{", "[]", '"ack"', "7", "NaN", "[" * 5000),
    *('{"do": "fly"}', '{"do": "time"}', '{"do": "time", "value": NaN}', '{"do": "pick", "x": 9}'),
    *('{"ack": "1"}', '{"ack": [1]}', '{"ack": null}'),
)
PAGE = Path(__file__).parents[2] / "sumo3dviz_pt" / "viewer" / "page"


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scenario(tmp_path_factory.mktemp("server"))


def studio_of(scene: Path) -> RenderThread:
    return RenderThread(load_job(scene), scene_file=scene, size=SIZE)


# Who is let in, and what lies there: nothing has to be rendered for this --------------------


@pytest.fixture(scope="module")
def ask(scene: Path) -> Callable[..., tuple[int, dict[str, str], bytes]]:
    """Asks the routes of a viewer that renders nothing yet: status, headers, body."""
    render_thread = studio_of(scene)

    def ask(path: str, method: str = "GET", **headers: str) -> tuple[int, dict[str, str], bytes]:
        async def talk() -> tuple[int, dict[str, str], bytes]:
            async with TestClient(TestServer(application(render_thread, TOKEN))) as client:
                given = {name.replace("_", "-"): value for name, value in headers.items()}
                answer = await client.request(
                    method, path, headers=given, allow_redirects=False, skip_auto_headers=["Accept"]
                )
                return answer.status, dict(answer.headers), await answer.read()

        return asyncio.run(talk())

    return ask


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        (f"/{TOKEN}/", {}, 200),
        (f"/{TOKEN}/viewer.js", {}, 200),
        (f"/{TOKEN}", {}, 308),
        (f"/{TOKEN}/", {"Host": "localhost:8123"}, 200),
        (f"/{TOKEN}/", {"Host": "[::1]:8123"}, 200),
        (f"/{TOKEN}/", {"Host": "localhost:8123", "Origin": "http://localhost:8123"}, 200),
        ("/", {}, 404),
        ("/favicon.ico", {}, 404),
        ("/viewer.js", {}, 404),
        (f"/{TOKEN}x/", {}, 404),
        (f"/{TOKEN[:-1]}/", {}, 404),
        (f"/{TOKEN.upper()}/", {}, 404),
        ("/%F0%9F%9A%97/", {}, 404),
        (f"/x/ws?token={TOKEN}", {}, 404),
        (f"/{TOKEN}/server.py", {}, 404),
        (f"/{TOKEN}/../server.py", {}, 404),
        (f"/{TOKEN}/%2e%2e%2fserver.py", {}, 404),
        (f"/{TOKEN}/a/b", {}, 404),
        (f"/{TOKEN}/stills/7.png", {}, 404),
        (f"/{TOKEN}/stills/x.png", {}, 404),
        (f"/{TOKEN}/", {"Host": "elsewhere.example"}, 403),
        (f"/{TOKEN}/", {"Host": "localhost.elsewhere.example:80"}, 403),
        (f"/{TOKEN}/", {"Host": "someone@localhost:80"}, 403),
        (f"/{TOKEN}/", {"Origin": "null"}, 403),
        (f"/{TOKEN}/", {"Host": "localhost:8123", "Origin": "http://localhost:8124"}, 403),
        (f"/{TOKEN}/", {"Host": "localhost:8123", "Origin": "https://localhost:8123"}, 403),
        (f"/{TOKEN}/ws", {"Origin": "http://elsewhere.example"}, 403),
    ],
)
def test_who_is_let_in(ask, path, headers, status) -> None:
    found, sent, body = ask(path, **headers)
    assert found == status
    assert len(body) > 20 or status == 308
    assert sent["X-Content-Type-Options"] == "nosniff"
    if status == 404:
        assert b"nothing at this address" in body or b"no such still" in body


@pytest.mark.parametrize(
    ("path", "headers", "status"),
    [
        (f"/{TOKEN}/", {"Host": "hub.example", "Origin": "https://hub.example"}, 200),
        (f"/{TOKEN}/", {"Host": "hub.example"}, 200),
        (f"/{TOKEN}/", {"Host": "hub.example", "Origin": "https://elsewhere.example"}, 403),
        ("/guess/", {"Host": "hub.example"}, 404),
    ],
)
def test_who_is_let_in_behind_a_notebook_server(scene, path, headers, status) -> None:
    async def talk() -> int:
        routes = application(studio_of(scene), TOKEN, proxied=True)
        async with TestClient(TestServer(routes)) as client:
            return (await client.get(path, headers=headers)).status

    assert asyncio.run(talk()) == status


@pytest.mark.parametrize("method", ["HEAD", "POST", "PUT", "DELETE", "OPTIONS"])
def test_it_can_only_be_asked(ask, method) -> None:
    assert ask(f"/{TOKEN}/", method)[0] == 405
    assert ask("/other/", method)[0] == 404


def test_headers_keep_the_page_to_itself(ask) -> None:
    _, sent, _ = ask(f"/{TOKEN}/", Host="localhost:8123")
    policy = dict(part.strip().split(" ", 1) for part in sent["Content-Security-Policy"].split(";"))
    assert policy["default-src"] == "'self'"
    assert policy["connect-src"] == "'self' ws://localhost:8123"
    assert policy["frame-ancestors"] == "'self' http://localhost:* http://127.0.0.1:*"
    assert "unsafe" not in sent["Content-Security-Policy"]
    assert sent["Referrer-Policy"] == "no-referrer"
    assert sent["Cache-Control"] == "no-store"
    assert "aiohttp" not in sent["Server"]


def test_all_that_the_page_names_is_there_and_nothing_outside(ask) -> None:
    kinds = {"html": "text/html", "css": "text/css", "js": "text/javascript"}
    names = {file.name for file in PAGE.iterdir()}
    named = set()
    for name in names:
        status, sent, body = ask(f"/{TOKEN}/{name}")
        assert status == 200 and body == (PAGE / name).read_bytes()
        assert sent["Content-Type"] == f"{kinds[name.split('.')[1]]}; charset=utf-8"
        text = body.decode("utf-8").replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://|url\(|@import|innerHTML|\beval\b", text), name
        named |= set(re.findall(r'(?:href|src)="([\w.]+)"|from "\./([\w.]+)"', text))
    assert {one or other for one, other in named} | {"index.html"} == names


def test_labels_and_ids_of_the_page_belong_together() -> None:
    text = (PAGE / "index.html").read_text(encoding="utf-8")
    ids = re.findall(r'\bid="([\w-]+)"', text)
    assert len(ids) == len(set(ids))
    pointers = re.findall(
        r'(?:for|aria-(?:labelledby|controls|describedby)|href)="#?([\w-]+)"', text
    )
    assert pointers and set(pointers) <= set(ids)
    used = {
        name
        for file in PAGE.glob("*.js")
        for name in re.findall(r'\$\("([\w-]+)"\)', file.read_text(encoding="utf-8"))
    }
    assert used and used <= set(ids)


# Beginnings that fail ----------------------------------------------------------------------


@pytest.mark.parametrize("token", ["", "a/b", "a b", "ä", "x" * 201])
def test_a_token_has_to_suit_an_address(scene, token) -> None:
    with pytest.raises(ConfigError, match=r"token: 1\.\.200 letters"):
        Server(studio_of(scene), token=token)


def test_a_port_that_is_taken_is_named(scene) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ConfigError, match=f"port: port {port} is in use; choose another"):
            Server(studio_of(scene), port=port)
    with pytest.raises(ConfigError, match=r"port: must lie in 0\.\.65535, not 70000"):
        Server(studio_of(scene), port=70_000)


def test_a_viewer_that_never_started_can_be_closed(scene) -> None:
    server = Server(studio_of(scene))
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{20,}/", server.address)
    server.close()
    server.close()
    assert not server.running


def test_without_its_extra_it_says_what_to_install() -> None:
    code = (
        "import sys; sys.modules['aiohttp'] = None\n"
        "import sumo3dviz_pt.api, sumo3dviz_pt.cli, sumo3dviz_pt.pipeline.production\n"
        "import sumo3dviz_pt.viewer.render_thread\n"
        "from sumo3dviz_pt.errors import ConfigError\n"
        "try: import sumo3dviz_pt.viewer.server\n"
        "except ConfigError as error: sys.stdout.write(str(error))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert re.fullmatch(
        r'the viewer needs aiohttp: pip install "\.\[viewer\]" in a checkout,'
        r' pip install "[\w.-]+\.whl\[viewer\]" with a wheel',
        done.stdout,
    )


# Conversations, with a render thread that renders ------------------------------------------


class Talk:
    """A client of the websocket."""

    def __init__(self, line: aiohttp.ClientWebSocketResponse) -> None:
        self.line = line
        self.notes: list[dict] = []

    async def say(self, **order: object) -> None:
        await self.line.send_str(json.dumps(order))

    async def note(self, kind: str) -> dict:
        """The next note of a kind; pictures on the way are acknowledged."""
        while True:
            found = await self.following()
            if found["kind"] == kind:
                return found
            if found["kind"] == "frame":
                await self.say(ack=found["seq"])

    async def frame(self, **expected: object) -> dict:
        """The next picture, or the next one of which something is said."""
        while True:
            found = await self.following()
            if found["kind"] == "frame":
                if expected.items() <= found.items():
                    return found
                await self.say(ack=found["seq"])

    async def following(self, seconds: float = 60.0) -> dict:
        """The next message; with a frame comes its picture."""
        said = json.loads(await self.line.receive_str(timeout=seconds))
        if said["kind"] == "frame":
            said["jpeg"] = await self.line.receive_bytes(timeout=seconds)
        return said

    async def silence(self, seconds: float) -> list[str]:
        """Kinds of all that is said in a while."""
        kinds = []
        end = asyncio.get_running_loop().time() + seconds
        while (left := end - asyncio.get_running_loop().time()) > 0:
            try:
                async with asyncio.timeout(left):
                    kinds.append((await self.following())["kind"])
            except TimeoutError:
                break
        return kinds


def visit(server: Server, *works: Callable[[Talk], Awaitable[None]]) -> None:
    """Clients at the same time, each with a websocket of its own."""

    async def one(session: aiohttp.ClientSession, work: Callable[[Talk], Awaitable[None]]) -> None:
        async with session.ws_connect(server.address + "ws") as line:
            await work(Talk(line))

    async def whole() -> None:
        async with aiohttp.ClientSession() as session:
            await asyncio.gather(*(one(session, work) for work in works))

    asyncio.run(whole())


@pytest.fixture(scope="module")
def server(scene: Path) -> Iterator[Server]:
    with Server(studio_of(scene), token=TOKEN) as running:
        yield running


@pytest.mark.slow
def test_a_conversation_begins_with_the_scene_and_a_picture(server) -> None:
    async def work(talk: Talk) -> None:
        scene = await talk.following()
        assert scene["kind"] == "scene"
        assert scene["cameras"] == ["post", "driver"] and scene["size"] == list(SIZE)
        first = await talk.frame()
        with Image.open(io.BytesIO(first["jpeg"])) as picture:
            assert picture.format == "JPEG" and list(picture.size) == first["size"]

    visit(server, work)


@pytest.mark.slow
def test_another_weather_is_for_all_and_can_be_taken_back(server) -> None:
    async def work(talk: Talk) -> None:
        told = await talk.note("scene")
        assert told["weather"] == "" and "dense_fog" in told["weathers"]
        for preset in ("dense_fog", ""):
            await talk.say(do="weather", preset=preset)
            assert (await talk.note("scene"))["weather"] == preset
        await talk.frame()
        await talk.say(do="weather", preset="frog")
        assert "did you mean 'fog'" in (await talk.note("note"))["text"]

    visit(server, work)


@pytest.mark.slow
def test_no_picture_comes_before_the_last_one_is_acknowledged(server) -> None:
    async def work(talk: Talk) -> None:
        first = await talk.frame()
        await talk.say(do="play", on=True)
        await talk.say(do="yaml")
        assert await talk.silence(1.0) == ["yaml"]
        await talk.say(ack=first["seq"] + 1)  # of a picture that was never sent
        assert await talk.silence(0.5) == []
        await talk.say(ack=first["seq"])
        second = await talk.frame()
        assert second["seq"] > first["seq"]
        await talk.say(do="play", on=False)

    visit(server, work)


@pytest.mark.slow
@pytest.mark.parametrize("said", NONSENSE)
def test_nonsense_does_no_harm(server, said) -> None:
    async def work(talk: Talk) -> None:
        await talk.frame()
        await talk.line.send_str(said)
        if "ack" not in said or said == '"ack"':
            note = await talk.note("note")
            assert note["level"] == "error" and len(note["text"]) < 400
        await talk.say(do="yaml")
        assert "eulerian" in (await talk.note("yaml"))["text"]

    visit(server, work)


@pytest.mark.slow
def test_a_path_that_cannot_be_saved_is_shown_with_the_reason(server, scene) -> None:
    before = scene.read_bytes()

    async def work(talk: Talk) -> None:
        for height in (5, 9):
            await talk.say(do="eye", position=[0, -30, height], heading=0, pitch=0, roll=0, fov=50)
            await talk.say(do="keyframe", act="add")
        await talk.say(do="keyframe", act="save", name="post")
        said = await talk.note("yaml")
        assert "post" in said["why"] and "mode: cinematic" in said["text"]

    visit(server, work)
    assert scene.read_bytes() == before


@pytest.mark.slow
def test_a_view_is_saved_or_shown_with_the_reason(scene, tmp_path) -> None:
    own = tmp_path / "scene.yaml"
    text = scene.read_text(encoding="utf-8")
    for name in ("net.net.xml", "fcd.xml", "types.add.xml"):
        text = text.replace(f" {name}", f" {(scene.parent / name).as_posix()}")
    own.write_text(text, encoding="utf-8")

    async def work(talk: Talk) -> None:
        await talk.say(do="eye", position=[1, -30, 9], heading=10, pitch=-5, roll=0, fov=42)
        for name, reason in (("post", "'post2' is free"), ("1", "starts with a letter")):
            await talk.say(do="save", name=name)
            said = await talk.note("yaml")
            assert reason in said["why"] and "mode: eulerian" in said["text"]
        assert own.read_text(encoding="utf-8") == text
        await talk.say(do="save", name="kerb")
        assert "saved as camera kerb" in (await talk.note("note"))["text"]

    with Server(studio_of(own), token=TOKEN) as running:
        visit(running, work)
    camera = load_job(own).cameras["kerb"]
    assert (camera.position, camera.heading, camera.pitch) == ((1.0, -30.0, 9.0), 10.0, -5.0)
    assert camera.lens.fov == 42.0 and camera.clear_view is False


@pytest.mark.slow
def test_a_client_that_talks_too_much_is_cut_off(server) -> None:
    async def work(talk: Talk) -> None:
        await talk.line.send_str('"' + "x" * 100_000 + '"')
        while not talk.line.closed:
            await talk.line.receive(timeout=60.0)
        assert talk.line.close_code == aiohttp.WSCloseCode.MESSAGE_TOO_BIG

    visit(server, work)


@pytest.mark.slow
def test_two_pages_are_served_each_its_own(server) -> None:
    async def moves(talk: Talk) -> None:
        await talk.say(do="time", value=3.0)
        await talk.say(do="eye", position=[0, -30, 9], heading=0, pitch=-10, roll=0, fov=50)
        found = await talk.frame(time=3.0, size=list(SIZE))
        assert found["eye"]["position"] == [0, -30, 9]

    async def stays(talk: Talk) -> None:
        await talk.following()
        await talk.frame()
        await asyncio.sleep(0.5)

    visit(server, moves, stays, moves, stays)


@pytest.mark.slow
def test_a_still_is_taken_and_fetched(server) -> None:
    async def work(talk: Talk) -> None:
        await talk.say(do="still", quality="draft")
        still = await talk.note("still")
        async with (
            aiohttp.ClientSession() as session,
            session.get(server.address + still["url"]) as answer,
        ):
            assert answer.status == 200 and answer.content_type == "image/png"
            with Image.open(io.BytesIO(await answer.read())) as picture:
                assert picture.format == "PNG" and picture.size == SIZE

    visit(server, work)


@pytest.mark.slow
@pytest.mark.parametrize("path", ["guessed/ws", "ws", f"{TOKEN}/ws"])
def test_a_foreign_page_gets_no_line(server, path) -> None:
    async def whole() -> int:
        address = server.address.removesuffix(f"{TOKEN}/") + path
        origin = "http://elsewhere.example" if path.startswith(TOKEN) else None
        async with aiohttp.ClientSession() as session:
            with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                await session.ws_connect(address, origin=origin)
        return refused.value.status

    assert asyncio.run(whole()) == (403 if path.startswith(TOKEN) else 404)


# The end -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_at_the_end_pages_hear_why_and_nothing_is_left(scene) -> None:
    before = set(threading.enumerate())
    server = Server(studio_of(scene))
    server.start()
    port = int(server.address.split(":")[2].split("/")[0])

    async def work(talk: Talk) -> None:
        await talk.frame()
        closing = asyncio.create_task(asyncio.to_thread(server.close))
        message = await talk.line.receive(timeout=60.0)
        while message.type is not aiohttp.WSMsgType.CLOSE:
            message = await talk.line.receive(timeout=60.0)
        assert message.data == aiohttp.WSCloseCode.GOING_AWAY
        assert message.extra == "The viewer was stopped."
        await talk.line.close()
        await closing

    visit(server, work)
    assert not server.running
    assert set(threading.enumerate()) <= before
    with socket.create_server(("127.0.0.1", port)):
        pass


@pytest.mark.slow
def test_a_scene_that_cannot_be_built_is_said_before_anybody_is_invited(scene, tmp_path) -> None:
    broken = tmp_path / "scene.yaml"
    text = scene.read_text(encoding="utf-8")
    text = text.replace("network: net", f"network: {scene.parent.as_posix()}/net")
    text = text.replace("trajectories: fcd", f"trajectories: {scene.parent.as_posix()}/fcd")
    text = text.replace("vehicle_types: types", f"vehicle_types: {scene.parent.as_posix()}/types")
    broken.write_text(text + "ground: {texture: missing.png}\n", encoding="utf-8")
    server = Server(studio_of(broken))
    with pytest.raises(Sumo3dvizError, match=r"missing\.png"):
        server.start()
    assert not server.running
    server.close()


SERVE = """
import sys
from pathlib import Path
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.viewer.server import serve
from sumo3dviz_pt.viewer.render_thread import RenderThread
render_thread = RenderThread(load_job(Path(sys.argv[1])), size=(64, 36))
serve(render_thread, port=0, token=None, announce=lambda text: print(text, flush=True))
print("ended", flush=True)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows knows no such signals")
@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_it_in_good_order(scene, which) -> None:
    command = [sys.executable, "-c", SERVE, str(scene)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8"
    ) as process:
        assert process.stdout is not None and process.stdout.readline().startswith("http://127.")
        process.send_signal(which)
        said, complained = process.communicate(timeout=60.0)
    assert (process.returncode, said, complained) == (0, "ended\n", "")
