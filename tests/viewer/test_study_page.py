"""The page of a study plays its films in a real browser, and loses nothing that happens.

jsPsych is no part of this repository: `npm install jspsych` puts it into a folder `node_modules`,
and the environment variable SUMO3DVIZ_PT_NODE_MODULES names that folder. What the page says without
jsPsych needs Chromium alone.
"""

from __future__ import annotations

import functools
import http.server
import json
import os
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from needed import lacking, skip_if
from viewer.browser import Browser, chromium

from sumo3dviz_pt.job.study import OWN_COLUMNS
from sumo3dviz_pt.studies.designs.trials import Trial, build_playlists, single_trials
from sumo3dviz_pt.studies.outputs import write_cards
from sumo3dviz_pt.studies.tools.content import (
    Clip,
    During,
    Form,
    Screen,
    StudyContent,
    StudySession,
    Words,
)
from sumo3dviz_pt.studies.tools.datasets import digest_of
from sumo3dviz_pt.studies.tools.pages import own_texts, page
from sumo3dviz_pt.studies.tools.surveys import question, write_survey_script
from sumo3dviz_pt.video import encode

PACKAGES = Path(os.environ.get("SUMO3DVIZ_PT_NODE_MODULES", "no folder"))

pytestmark = [
    pytest.mark.slow,
    skip_if(chromium() is None, "there is no Chromium on the PATH"),
]
WORDS = Words("How safe?", "Which?", ("1", "2", "3"), "not", "very", "None", "en", "Gaps", "x")
DAY, NIGHT = ("day",), ("night",)
DESKTOP, PHONE = (1000, 760), (390, 844)
FRAMES, RATE = 15, 25
TEXTS = own_texts()["en"]["page"]
ENGLISH = StudySession(TEXTS)


class Server(http.server.SimpleHTTPRequestHandler):
    """A server that says nothing, that can be slow or fail, and keeps what is posted."""

    protocol_version = "HTTP/1.1"
    posted: ClassVar[list] = []
    refused: ClassVar[int] = 0  # how many of the next posts fail
    slow: ClassVar[set] = set()  # names of films that take two seconds
    broken: ClassVar[dict] = {}  # bytes instead of a film's; None is missing

    def log_message(self, *_: object) -> None:
        pass

    def end_headers(self) -> None:
        self.send_header("Cache-Control", "no-cache")  # every test has other faults
        super().end_headers()

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        if Server.refused:
            Server.refused -= 1
            self.send_error(503)
        else:
            Server.posted.append((self.path, body))
            self.reply(b'{"token": "t1"}')

    def do_GET(self) -> None:
        name = self.path.rpartition("/")[2]
        if name not in Server.broken and name not in Server.slow:
            super().do_GET()
        elif name in Server.slow:
            self.reply(Path(self.translate_path(self.path)).read_bytes(), steps=8, wait=0.25)
        elif Server.broken[name] is None:
            self.send_error(404)
        else:
            self.reply(Server.broken[name])

    def reply(self, content: bytes, steps: int = 1, wait: float = 0.0) -> None:
        self.send_response(200)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        for step in range(steps):
            self.wfile.write(
                content[len(content) * step // steps : len(content) * (step + 1) // steps]
            )
            time.sleep(wait)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Films of 0.6 s, whose frames have a grey that tells their number."""
    place = tmp_path_factory.mktemp("pages")
    (place / "materials").mkdir()
    for name, size in (("day", (64, 36)), ("night", (64, 36)), ("large", (1920, 1080))):
        frames = [np.full((*size[::-1], 3), 14 * n + 20, np.uint8) for n in range(FRAMES)]
        encode(frames, place / "materials" / f"{name}.mp4", size=size, fps=RATE)
    return place


@pytest.fixture(scope="module")
def address(folder):
    """A web server in the folder."""
    handler = functools.partial(Server, directory=folder)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture(scope="module")
def browser():
    with Browser() as found:
        yield found


@pytest.fixture(autouse=True)
def _well():
    """A server without faults."""
    Server.posted, Server.refused, Server.slow, Server.broken = [], 0, set(), {}


def clip(folder, name):
    size = (1920, 1080) if name == "large" else (64, 36)
    file = f"materials/{name}.mp4"
    return Clip(name, name, file, FRAMES / RATE, size, str(RATE), digest_of(folder / file), 60.0)


def study(folder, trials=None, *, films=("day", "night"), **more):
    """A study of two films."""
    trials = trials or single_trials([DAY, NIGHT])
    clips = {DAY: clip(folder, films[0]), NIGHT: clip(folder, films[1])}
    lists = build_playlists(trials, order="as_written", count=None, parts=1, repeat=1, seed=0)
    levels = {"light": ("day", "night")}
    found = StudyContent({"light": ""}, levels, clips, trials, lists, WORDS, session=ENGLISH)
    return replace(found, **more)


class Visit:
    """Somebody at a study's page."""

    def __init__(self, browser, address, folder, content, *, size=DESKTOP, query=""):
        if not PACKAGES.is_dir():
            lacking("jsPsych is not here")
        content = replace(content, jspsych="node_modules/")
        if not (folder / "node_modules").exists():
            (folder / "node_modules").symlink_to(PACKAGES.resolve())
        name = f"page{sum(1 for _ in folder.glob('*.html'))}.html"
        (folder / name).write_text(page(content), "utf-8")
        # Everybody is somebody else: the browser remembers who was there.
        self.url = f"{address}/{name}?playlist=1&save=no&{query or f'participant={name[4:-5]}'}"
        self.page = browser.open(self.url)
        self.page.resize(*size)
        self.page.wait_for("!!document.querySelector('button')")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.page.close()

    def press(self, words, *, seconds=60.0):
        """Click a button by its words as a finger does, as soon as it is open."""
        self.page.wait_for(
            "(() => { const open = [...document.querySelectorAll('button')].find("
            f"b => !b.disabled && b.textContent === {json.dumps(words)});"
            " if (open) open.id = 'pressed'; return !!open; })()",
            seconds=seconds,
        )
        self.page.click("#pressed")
        self.page.evaluate("document.getElementById('pressed')?.removeAttribute('id')")

    def reload(self):
        self.page.navigate(self.url)
        self.page.wait_for("!!document.querySelector('button')")

    @property
    def said(self):
        return self.page.evaluate("document.body.innerText")

    def rows(self, kind="answer"):
        """What the page recorded, once it is over; all errors but the expected are failures."""
        self.page.wait_for("'answers' in window")
        found = self.page.evaluate("window.answers")
        for row in found:
            own = {key for key in row if not key.startswith(("light", "presence_"))}
            assert own <= OWN_COLUMNS | {"attention_1", "comments_1", "film_1", "film_2"}, (
                own - OWN_COLUMNS
            )
        return found if kind is None else [row for row in found if row["row_kind"] == kind]


# Times, pauses, what happens beside ----------------------------------------------------------


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_answers_hold_times_from_start_and_end_and_how_the_film_was_shown(
    browser, address, folder, size
):
    with Visit(browser, address, folder, study(folder), size=size) as visit:
        visit.press("Start")
        visit.press("3")
        visit.press("1")
        found = visit.rows()
        assert not [error for error in visit.page.errors if "favicon" not in error]
        films = [url for url in visit.page.requests if url.endswith(".mp4")]
    assert len(films) == len(set(films)) == 2
    assert [(a["light"], a["answer"], a["position"]) for a in found] == [
        ("day", "3", 1),
        ("night", "1", 2),
    ]
    for row in found:
        assert row["participant"].isdecimal() and "Chrome" in row["browser"]
        assert row["page_time"][:4] == time.strftime("%Y") and row["page_time"][-6] in "+-"
        assert 550 < row["film_ms"] < 1200 and row["film_certified"] == 1
        assert 0 < row["rt_end"] < row["rt_start"]
        assert abs(row["rt_start"] - row["rt_end"] - row["film_ms"]) <= 1
        assert row["film_clock"] == "frames"
        assert 0 <= row["film_frames_dropped"] < FRAMES and row["film_frames_repeated"] >= 0
        assert (row["film_paused"], row["film_hidden_ms"], row["page_hidden"]) == (0, 0, 0)


HIDE = (
    "Object.defineProperty(document, 'hidden', {value: %s, configurable: true});"
    "document.dispatchEvent(new Event('visibilitychange'))"
)


def test_pauses_and_hidden_tabs_are_recorded(browser, address, folder):
    with Visit(browser, address, folder, study(folder, single_trials([DAY]))) as visit:
        visit.press("Start")
        visit.page.wait_for("(document.querySelector('video')?.currentTime ?? 0) > 0.2")
        visit.page.evaluate("document.querySelector('video').pause()")
        visit.page.evaluate(HIDE % "true")
        time.sleep(0.5)
        visit.page.evaluate(HIDE % "false")
        visit.press(TEXTS["go_on"])
        visit.press("2")
        (row,) = visit.rows()
    assert row["film_paused"] == 1 and row["film_paused_ms"] >= 500
    assert row["page_hidden"] == 1 and 500 <= row["page_hidden_ms"] < row["film_paused_ms"] + 50
    # On a busy machine the first picture that is seen may be a later one.
    assert row["film_ms"] >= row["film_paused_ms"] + 300 and row["film_frames_dropped"] < FRAMES


@pytest.mark.parametrize(("rate", "column"), [(0.4, "repeated"), (8.0, "dropped")])
def test_frames_that_are_repeated_or_dropped_are_counted(browser, address, folder, rate, column):
    """By a film that plays too slowly or too fast for the screen."""
    with Visit(browser, address, folder, study(folder, single_trials([DAY]))) as visit:
        visit.page.evaluate(
            f"HTMLVideoElement.prototype.play = (play => function () {{"
            f" this.playbackRate = {rate}; return play.call(this); }}"
            f")(HTMLVideoElement.prototype.play)"
        )
        visit.press("Start")
        visit.press("2")
        (row,) = visit.rows()
    assert row[f"film_frames_{column}"] >= FRAMES // 2


# Faults of films -----------------------------------------------------------------------------


@pytest.mark.parametrize("content", [None, b"this is no film", b""])
@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_a_film_that_cannot_be_shown_is_tried_again_or_left_out(
    browser, address, folder, content, size
):
    Server.broken = {"day.mp4": content}
    with Visit(browser, address, folder, study(folder), size=size) as visit:
        visit.press("Start")
        visit.press(TEXTS["retry"])
        visit.press(TEXTS["skip"])
        visit.press("3")
        broken, whole = visit.rows()
    kind = "missing" if content is None else "undecodable"
    assert broken["film_problems"] == f"{kind};{kind}"
    assert (broken["film_skipped"], broken["film_retries"], broken["answer"]) == (1, 1, "")
    assert (whole["film_skipped"], whole["film_retries"], whole["answer"]) == (0, 0, "3")


def test_a_film_that_is_there_again_is_shown(browser, address, folder):
    Server.broken = {"day.mp4": None}
    with Visit(browser, address, folder, study(folder, single_trials([DAY]))) as visit:
        visit.press("Start")
        visit.page.wait_for("!!document.querySelector('.problem')")
        Server.broken = {}
        visit.press(TEXTS["retry"])
        visit.press("1")
        (row,) = visit.rows()
    assert (row["film_skipped"], row["film_retries"], row["answer"]) == (0, 1, "1")


def test_a_slow_film_is_waited_for_and_never_stalls(browser, address, folder):
    Server.slow = {"day.mp4"}
    with Visit(browser, address, folder, study(folder, single_trials([DAY]))) as visit:
        visit.press("Start")
        visit.page.wait_for("/[1-9]\\d? %/.test(document.body.innerText)")
        visit.press("1")
        (row,) = visit.rows()
    assert row["film_loading_ms"] >= 800 and row["film_ms"] < 1200
    assert (row["film_stalled"], row["film_skipped"]) == (0, 0)


def test_another_film_than_the_studys_is_told(browser, address, folder):
    Server.broken = {"day.mp4": (folder / "materials" / "large.mp4").read_bytes()}
    with Visit(browser, address, folder, study(folder, single_trials([DAY]))) as visit:
        visit.press("Start")
        visit.press("1")
        (row,) = visit.rows()
    assert row["film_certified"] == 0


# Reloads, ends -------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_a_reload_goes_on_and_the_end_stays_the_end(browser, address, folder, size):
    with Visit(browser, address, folder, study(folder), size=size) as visit:
        visit.press("Start")
        visit.press("3")
        visit.page.wait_for("!!document.querySelector('video')?.currentTime")
        visit.reload()
        assert TEXTS["again"] in visit.said
        visit.press(TEXTS["resume"])
        visit.press("1")
        found = visit.rows()
        visit.reload()
        assert TEXTS["finished"] in visit.said
        assert visit.page.evaluate("window.answers.length") == len(visit.rows(None))
        visit.press(TEXTS["anew"])
        visit.press("Start")
    assert [(a["answer"], a["position"], a["attempt"]) for a in found] == [("3", 1, 1), ("1", 2, 2)]
    assert [a["page_loads"] for a in found] == [1, 2]
    assert len({a["visit"] for a in found}) == 1


def test_a_second_window_waits_for_the_first(browser, address, folder):
    """Both would keep answers in one place."""
    with Visit(browser, address, folder, study(folder, single_trials([DAY]))) as visit:
        second = browser.open(visit.url)
        second.wait_for(f"document.body?.innerText.includes({json.dumps(TEXTS['elsewhere'])})")
        visit.press("Start")
        visit.press("3")
        assert len(visit.rows()) == 1
    second.wait_for(f"document.body?.innerText.includes({json.dumps(TEXTS['finished'])})")
    second.close()


def test_chance_gives_the_same_playlist_after_a_reload(browser, address, folder):
    trials = single_trials([DAY, NIGHT])
    lists = build_playlists(trials, order="random", count=50, parts=1, repeat=1, seed=0)
    with Visit(browser, address, folder, study(folder, playlists=lists), query="x=1") as visit:
        visit.url = visit.url.replace("playlist=1&", "")
        seen = set()
        for _ in range(3):
            visit.reload()
            visit.press(visit.page.evaluate("document.querySelector('button').textContent"))
            visit.page.wait_for("!!document.querySelector('video')")
            keys = "Object.keys(localStorage).filter((key) => key.includes(study.digest + '::'))"
            seen |= set(visit.page.evaluate(keys))
    assert len(seen) == 1


# Where answers go ----------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["post", "datapipe", "pavlovia"])
def test_answers_are_posted_one_by_one_and_faults_lose_none(browser, address, folder, kind):
    """The services' requests have the form that their own clients send; no service was asked."""
    endpoint = {"kind": kind, "url": f"{address}/", "experiment": "e1"}
    content = study(folder, session=replace(ENGLISH, endpoint=endpoint))
    Server.refused = 3
    with Visit(browser, address, folder, content) as visit:
        visit.press("Start")
        visit.press("3")
        visit.page.wait_for("!!document.querySelector('video')?.currentTime")
        visit.reload()
        visit.press(TEXTS["resume"])
        visit.press("1")
        visit.page.wait_for("document.body.innerText.trim() === 'Thank you.'")
        rows = visit.rows(None)
    assert len(rows) == 5  # start, answer, start again, answer, end
    if kind == "post":
        assert [json.loads(body) for _, body in Server.posted] == rows
    elif kind == "datapipe":
        sent = [json.loads(body) for _, body in Server.posted]
        assert {each["experimentID"] for each in sent} == {"e1"}
        assert len({each["filename"] for each in sent}) == 5
        assert [json.loads(each["data"]) for each in sent] == rows
    else:
        paths = [path for path, _ in Server.posted]
        assert paths == ["//api/v2/experiments/e1/sessions".replace("//", "/")] + 5 * [
            "/api/v2/experiments/e1/sessions/t1/results"
        ]


def test_jatos_gets_every_row_and_the_end(browser, address, folder):
    """Against the functions that its own jatos.js documents."""
    endpoint = {"kind": "jatos", "url": None, "experiment": None}
    (folder / "jatos.js").write_text(
        "window.got = []; window.jatos = {urlQueryParameters: {participant: '9'},"
        " onLoad: (then) => setTimeout(then, 50), endStudy: () => { window.ended = true; },"
        " appendResultData: async (text) => { window.got.push(text); }};",
        "utf-8",
    )
    content = study(folder, single_trials([DAY]), session=replace(ENGLISH, endpoint=endpoint))
    with Visit(browser, address, folder, content, query="a=1") as visit:
        visit.press("Start")
        visit.press("3")
        visit.page.wait_for("window.ended")
        got = [json.loads(line) for line in visit.page.evaluate("window.got")]
        assert got == visit.rows(None) and {row["participant"] for row in got} == {"9"}


def test_what_cannot_be_sent_stays_and_is_offered_as_a_file(browser, address, folder):
    endpoint = {"kind": "post", "url": f"{address}/answers", "experiment": None}
    content = study(folder, single_trials([DAY]), session=replace(ENGLISH, endpoint=endpoint))
    Server.refused = 1000
    with Visit(browser, address, folder, content) as visit:
        visit.page.evaluate("Sender.prototype.all = async function () { return !this.left; }")
        visit.press("Start")
        visit.press("3")
        visit.page.wait_for(f"document.body.innerText.includes({json.dumps(TEXTS['unsent'])})")
        assert TEXTS["download"] in visit.said
        visit.reload()  # while nothing is taken: a row whose reply is lost would be sent again
        Server.refused = 0
        visit.page.wait_for(
            "JSON.parse(localStorage.getItem(Object.keys(localStorage).find((key) =>"
            " key.includes(`${study.digest}:`) && key.endsWith(':1')))).sent === 3"
        )
    assert [json.loads(body)["row_kind"] for _, body in Server.posted] == ["start", "answer", "end"]


def test_tables_are_safe_in_spreadsheets(browser, address, folder):
    with Visit(browser, address, folder, study(folder)) as visit:
        table = visit.page.evaluate(
            'tableOf([{a: "=1+1", b: -1.5, c: "+3"}, {a: "-x", d: \'say "a", b\', c: "@y"}])'
        )
    assert table == 'a,b,c,d\n\'=1+1,-1.5,+3,\n\'-x,,\'@y,"say ""a"", b"\n'


# Presses during the film ---------------------------------------------------------------------

GREY = (
    "window.greys = []; for (const name of ['keydown', 'pointerdown'])"
    " document.addEventListener(name, (event) => {"
    " const video = document.querySelector('video'); if (!video || event.repeat) return;"
    " const canvas = new OffscreenCanvas(8, 8), context = canvas.getContext('2d');"
    " context.drawImage(video, 0, 0, 8, 8);"
    " window.greys.push(context.getImageData(4, 4, 1, 1).data[0]); }, true);"
)


INSIDE = (
    "(() => { const seen = (e) => { const b = e?.getBoundingClientRect(); return !!b"
    " && b.left >= 0 && b.top >= 0 && b.right <= innerWidth && b.bottom <= innerHeight; };"
    " return {film: seen(document.querySelector('video')),"
    " button: seen(document.querySelector('.during button'))}; })()"
)
"""Whether the film and the button lie within the window, so that nobody has to scroll."""


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_presses_hold_the_films_time_to_a_frame(browser, address, folder, size):
    """What the film showed is read from its own grey at that moment."""
    during = During(("space", "j"), "I would cross", "Press when you would cross.")
    content = study(folder, single_trials([DAY]), session=replace(ENGLISH, during=during))
    with Visit(browser, address, folder, content, size=size) as visit:
        visit.page.evaluate(GREY)
        told = 'you press the space bar or J, or the button "I would cross".'
        assert told in visit.said and "Press when you would cross." in visit.said
        visit.press("Start")
        visit.page.wait_for("(document.querySelector('video')?.currentTime ?? 0) > 0.1")
        visit.page.evaluate("window.greys.length = 0")
        assert told in visit.said
        visit.page.hold("Space", seconds=0.1)
        visit.page.press("KeyK")
        visit.page.press("KeyJ")
        visit.page.click(".during button")
        visit.page.wait_for("document.querySelector('video').ended")
        visit.page.press("KeyJ")  # too late
        visit.press("2")
        (row,) = visit.rows()
        greys = [
            grey for n, grey in enumerate(visit.page.evaluate("window.greys")) if n in (0, 2, 3)
        ]
    frames = [int(each) for each in row["press_frames"].split(";")]
    assert (row["presses"], row["press_keys"]) == (3, "space;j;button")
    shown = [(grey - 20) / 14 for grey in greys]
    assert np.abs(np.subtract(frames, shown)).max() <= 1.2, (frames, shown)
    times = [float(each) for each in row["press_film_times"].split(";")]
    assert np.abs(np.multiply(times, RATE) - frames).max() < 0.5
    assert float(row["press_held_ms"].split(";")[0]) >= 100
    assert times == sorted(times) and row["answer"] == "2"


def test_a_touch_screen_has_a_button_that_stands_for_the_keys(browser, address, folder):
    session = replace(ENGLISH, during=During(("space",), only=True))
    content = study(folder, single_trials([DAY]), session=session)
    with Visit(browser, address, folder, content, size=PHONE) as visit:
        visit.page.send("Emulation.setTouchEmulationEnabled", enabled=True)
        visit.press("Start")
        visit.page.wait_for("document.body.innerText.includes('ready')")
        assert 'you press the button "Press".' in visit.said
        visit.press(TEXTS["ready"])
        visit.page.wait_for("(document.querySelector('video')?.currentTime ?? 0) > 0.1")
        inside = visit.page.evaluate(INSIDE)
        x, y = visit.page.place(".during button")
        touch = [{"x": x, "y": y}]
        visit.page.send("Input.dispatchTouchEvent", type="touchStart", touchPoints=touch)
        visit.page.send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        (row,) = visit.rows()
    assert inside == {"film": True, "button": True}
    assert (row["presses"], row["press_keys"]) == (1, "button")
    assert 0 < float(row["press_film_times"]) < FRAMES / RATE


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_before_films_without_a_question_people_rest_and_read_which_key(
    browser, address, folder, size
):
    """After consent, too; the rest is no row, and the space bar ends it as a click does."""
    during = During(("space",), text="Press when you would cross.", only=True)
    session = replace(ENGLISH, during=during, consent="Do you agree?")
    with Visit(browser, address, folder, study(folder, session=session), size=size) as visit:
        visit.press(TEXTS["agree"])
        for number in (1, 2):
            visit.page.wait_for("document.body.innerText.includes('ready')")
            assert f"Film {number} of 2" in visit.said and during.text in visit.said
            assert "you press the space bar." in visit.said
            visit.page.press("Space")
            visit.page.wait_for("(document.querySelector('video')?.currentTime ?? 0) > 0.1")
            assert visit.page.evaluate(INSIDE)["film"]
            assert during.text not in visit.said and "you press" not in visit.said
        found = visit.rows(None)
    kinds = [row["row_kind"] for row in found]
    assert kinds == ["consent", "answer", "answer", "end"]
    rows = [row for row in found if row["row_kind"] == "answer"]
    assert [(row["presses"], row["press_frames"], row["answer"]) for row in rows] == 2 * [
        (0, "", "")
    ]


# Sizes ---------------------------------------------------------------------------------------

BOXES = (
    "(() => [...document.querySelectorAll('video, button')].map((e) => {"
    " const b = e.getBoundingClientRect(); return [e.tagName, b.left, b.top, b.right, b.bottom];"
    " }))()"
)


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
@pytest.mark.parametrize("wide", [None, 4000])
def test_a_film_larger_than_the_window_is_fitted_and_buttons_are_for_fingers(
    browser, address, folder, size, wide
):
    words = replace(WORDS, answers=tuple("1234567"))
    screen = (
        None if wide is None else Screen(wide / 200 / np.tan(np.radians(30)) / 50, 50.0, "card")
    )
    content = study(folder, single_trials([DAY]), films=("large", "night"), words=words)
    with Visit(browser, address, folder, replace(content, screen=screen), size=size) as visit:
        visit.press("Start")
        visit.page.wait_for("document.querySelector('video')?.ended")
        boxes = visit.page.evaluate(BOXES)
        inline = visit.page.evaluate("document.querySelector('video').hasAttribute('playsinline')")
        visit.press("7")
        (row,) = visit.rows()
    assert inline and len(boxes) == 8
    for tag, left, top, right, bottom in boxes:
        assert left >= 0 and top >= 0 and right <= size[0] and bottom <= size[1], (tag, boxes)
        assert tag == "VIDEO" or (right - left >= 44 and bottom - top >= 44)
    assert len({top for tag, _, top, *_ in boxes if tag == "BUTTON"}) == 1, "a scale is one row"
    _, left, top, right, bottom = boxes[0]
    assert (right - left) / (bottom - top) == pytest.approx(16 / 9, rel=0.01)
    assert row["film_fitted"] == 1 and row["film_width"] == pytest.approx(right - left, abs=1)


def test_films_are_as_wide_as_the_angle_of_their_lens(browser, address, folder):
    content = study(folder, single_trials([DAY]), screen=Screen(0.3, 10.0, "card"))
    with Visit(browser, address, folder, content) as visit:
        visit.press("Start")
        visit.press("2")
        (row,) = visit.rows()
    # 2 x 30 cm x tan(30 deg) x 10 px/cm
    assert row["film_width"] == pytest.approx(346.4, abs=1) and row["film_fitted"] == 0


def test_a_bank_card_tells_how_large_pixels_are(browser, address, folder):
    content = study(folder, single_trials([DAY]), screen=Screen(0.3, None, "card"))
    with Visit(browser, address, folder, content) as visit:
        visit.press("Start")
        visit.page.wait_for("!!document.getElementById('size')")
        visit.page.choose("#size", 214)
        visit.press("Continue")
        visit.press("2")
        (row,) = visit.rows()
    assert row["px_per_cm"] == pytest.approx(25.0)
    assert row["film_width"] == pytest.approx(866.0, abs=1)


# Choices -------------------------------------------------------------------------------------

TASKS = (Trial("1", "1", (DAY, NIGHT, None)), Trial("1", "2", (NIGHT, DAY, None)))


def test_films_of_a_choice_are_shown_one_after_the_other(browser, address, folder):
    with Visit(browser, address, folder, study(folder, TASKS)) as visit:
        visit.press("Start")
        visit.press("B")
        visit.press("None")
        found, films = visit.rows(), visit.rows("film")
    assert [(a["light_1"], a["light_2"], a["answer"], a["chosen"]) for a in found] == [
        ("day", "night", 2, "night"),
        ("night", "day", 3, ""),
    ]
    assert [(row["film"], row["film_place"]) for row in films] == [
        ("day", 1),
        ("night", 2),
        ("night", 1),
        ("day", 2),
    ]
    assert all(0 <= row["rt_end"] < row["rt_start"] - 1100 for row in found)


def test_a_task_that_a_reload_broke_off_is_shown_from_its_first_film(browser, address, folder):
    with Visit(browser, address, folder, study(folder, TASKS)) as visit:
        visit.press("Start")
        visit.press("A")
        visit.page.wait_for("document.querySelector('h2')?.textContent === 'B'")
        visit.reload()
        visit.press(TEXTS["resume"])
        visit.press("B")
        found, films = visit.rows(), visit.rows("film")
    assert [(a["position"], a["answer"], a["attempt"]) for a in found] == [(1, 1, 1), (2, 2, 2)]
    shown = [(row["position"], row["film_place"], row["attempt"]) for row in films]
    assert shown == [(1, 1, 1), (1, 2, 1), (2, 1, 1), (2, 1, 2), (2, 2, 2)]


def test_a_card_shows_all_films_at_once(browser, address, folder):
    content = study(folder, TASKS)
    content = replace(content, cards=write_cards(folder, content))
    with Visit(browser, address, folder, content) as visit:
        visit.press("Start")
        visit.press("B")
        visit.press("None")
        found, cards = visit.rows(), visit.rows("card")
    assert [row["film"].rpartition("/")[2] for row in cards] == ["b1t1.mp4", "b1t2.mp4"]
    assert [(a["light_1"], a["answer"], a["chosen"]) for a in found] == [
        ("day", 2, "night"),
        ("night", 3, ""),
    ]


# Blocks --------------------------------------------------------------------------------------


def test_who_does_not_agree_leaves_nothing(browser, address, folder):
    content = study(folder, session=replace(ENGLISH, consent="Do you agree?"))
    with Visit(browser, address, folder, content) as visit:
        visit.press(TEXTS["decline"])
        visit.page.wait_for(f"document.body.innerText.includes({json.dumps(TEXTS['declined'])})")
        kept = visit.page.evaluate(
            "Object.keys(localStorage).filter((key) => key.includes(study.digest)).length"
        )
        assert kept == 0 and not visit.page.evaluate("'answers' in window")


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_consent_practice_attention_and_forms_are_blocks_in_any_language(
    browser, address, folder, size
):
    german = own_texts()["de"]
    presence = german["forms"]["presence"]
    session = StudySession(
        german["page"],
        consent="Sind Sie einverstanden?",
        practice=1,
        attention=1,
        after=(
            Form("presence", presence["items"], presence["answers"], intro=presence["intro"]),
            Form("comments", german["forms"]["comments"]["items"]),
        ),
    )
    content = study(folder, session=session, words=replace(WORDS, language="de"))
    choose = (
        "document.querySelectorAll('fieldset').forEach((field) =>"
        " field.querySelectorAll('input')[%d].click())"
    )
    with Visit(browser, address, folder, content, size=size) as visit:
        visit.press("Ich stimme zu")
        visit.press("Weiter")
        visit.press("2")  # practice
        visit.press("Weiter")
        visit.press("3")
        visit.page.wait_for("document.body.innerText.includes('wählen Sie bitte die Antwort 2')")
        visit.page.evaluate(choose % 1)
        visit.press("Weiter")
        visit.press("1")
        visit.page.wait_for("document.querySelectorAll('fieldset').length === 3")
        visit.press("Weiter")  # nothing is answered yet
        assert visit.page.evaluate("document.querySelectorAll('fieldset').length") == 3
        visit.page.evaluate(choose % 4)
        visit.press("Weiter")
        visit.page.wait_for("!!document.querySelector('textarea')")
        visit.page.evaluate("document.querySelector('textarea').value = '=1+1 <b>'")
        visit.press("Weiter")
        rows = visit.rows(None)
        assert "Vielen Dank." in visit.said
    kinds = [row["row_kind"] for row in rows]
    assert kinds == [
        *("consent", "page", "practice", "page", "answer", "attention", "answer"),
        *("form", "form", "end"),
    ]
    by_kind = {row["row_kind"]: row for row in rows}
    assert by_kind["practice"]["light"] == "night" and by_kind["attention"]["attention_passed"] == 1
    assert [rows[7][f"presence_{n}"] for n in (1, 2, 3)] == ["5", "5", "5"]
    assert rows[8]["comments_1"] == "=1+1 <b>"


# Words, and what is missing -------------------------------------------------------------------


def test_words_that_look_like_scripts_are_shown(browser, address, folder):
    words = replace(WORDS, title="a <!--<script> b", question="</script> <b>c</b>")
    with Visit(browser, address, folder, study(folder, words=words)) as visit:
        visit.page.wait_for("document.body.innerText.includes('a <!--<script> b')")
        visit.press("Start")
        visit.page.wait_for("document.body.innerText.includes('</script> <b>c</b>')")
        assert visit.page.evaluate("[...document.querySelectorAll('b')].length") == 0


@pytest.mark.parametrize("place", ["nothing_here/", "http://127.0.0.1:9/"])
def test_without_jspsych_the_page_says_so_in_one_sentence(browser, address, folder, place):
    """A folder that nobody filled, and an address that does not answer."""
    name = f"without_{len(place)}.html"
    (folder / name).write_text(page(study(folder, jspsych=place)), "utf-8")
    shown = browser.open(f"{address}/{name}?playlist=1&save=no")
    said = shown.wait_for("document.querySelector('.notice')?.innerText.trim()")
    shown.close()
    assert said.startswith("Nothing is shown, because jsPsych could not be loaded from ")
    assert place in said and said.endswith("?") and ". " not in said


# Surveys -------------------------------------------------------------------------------------

SURVEYS = {
    "LimeSurvey": (
        '<form><div class="question-container"><div class="question-text">{text}</div><div'
        ' class="answer-container"><input type="radio" name="a"></div></div><button type="button"'
        ' id="ls-button-submit" onclick="window.passed = true">Next</button></form>'
    ),
    "Qualtrics": (
        '<form><div class="QuestionOuter"><div class="QuestionText">{text}</div><div'
        ' class="QuestionBody"><input type="radio" name="a"></div></div><input type="button"'
        ' id="NextButton" value="Next" onclick="window.passed = true"></form>'
    ),
}
"""What the pages of both consist of; neither was at hand."""


@pytest.mark.parametrize("survey", SURVEYS)
def test_surveys_play_one_film_after_the_other_before_an_answer(browser, address, folder, survey):
    content = study(folder, TASKS, url=f"{address}/")
    write_survey_script(folder, content)
    text = question(content, 2, "1")
    (folder / f"{survey}.html").write_text(
        f"<!doctype html><body>{SURVEYS[survey].format(text=text)}", "utf-8"
    )
    Server.broken = {"night.mp4": b"no film"}
    shown = browser.open(f"{address}/{survey}.html")
    closed = "[...document.querySelectorAll('[name=a], #ls-button-submit, #NextButton')]"
    shown.wait_for("document.querySelector('.films')?.innerText.includes('Try again')")
    assert shown.evaluate(f"{closed}.every((e) => e.disabled)")
    assert shown.evaluate("document.querySelector('h2').textContent") == "A"
    Server.broken = {}
    shown.click(".films button")
    shown.wait_for("document.querySelector('h2').textContent === 'B'")
    assert shown.evaluate(f"{closed}.every((e) => e.disabled)")
    assert shown.evaluate("document.querySelectorAll('video').length") == 1
    shown.wait_for(f"{closed}.every((e) => !e.disabled)")
    films = [url.rpartition("/")[2] for url in shown.requests if url.endswith(".mp4")]
    assert list(dict.fromkeys(films)) == ["night.mp4", "day.mp4"]
    assert "C: None" in shown.evaluate("document.body.innerText")
    shown.close()
