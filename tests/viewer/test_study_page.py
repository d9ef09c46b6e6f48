"""The page of a study plays its films in a real browser and records the answers.

jsPsych is no part of this repository: `npm install jspsych @jspsych/plugin-preload
@jspsych/plugin-html-button-response @jspsych/plugin-video-button-response` puts it into a folder
`node_modules`, and the environment variable SUMO3DVIZ_PT_NODE_MODULES names that folder. What the
page says without jsPsych needs Chromium alone.
"""

from __future__ import annotations

import functools
import http.server
import os
import shutil
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from needed import skip_if
from viewer.browser import Browser, chromium

from sumo3dviz_pt.experiments.playlists import build_playlists
from sumo3dviz_pt.experiments.tools.content import Clip, Screen, StudyContent, Words
from sumo3dviz_pt.experiments.tools.jspsych import write_jspsych
from sumo3dviz_pt.experiments.trials import Trial, single_trials
from sumo3dviz_pt.pipeline.studies.cards import write_cards
from sumo3dviz_pt.video import encode

PACKAGES = Path(os.environ.get("SUMO3DVIZ_PT_NODE_MODULES", "no folder"))

pytestmark = [
    pytest.mark.slow,
    skip_if(chromium() is None, "there is no Chromium on the PATH"),
]
WORDS = Words("How safe?", "Which?", ("1", "2", "3"), "not", "very", "None", "en", "Gaps", "x")
DAY, NIGHT = ("day",), ("night",)


class Quiet(http.server.SimpleHTTPRequestHandler):
    """A server that says nothing."""

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def address(tmp_path):
    """A web server in the study's folder."""
    handler = functools.partial(Quiet, directory=tmp_path)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    thread.join()
    server.server_close()


def study(folder, trials, screen=None, cards=False, jspsych="node_modules/", packages=True):
    """Write the page, its films and, unless it is to be missing, jsPsych."""
    if packages and not PACKAGES.is_dir():
        pytest.skip("jsPsych is not here")
    (folder / "materials").mkdir()
    clips = {}
    for profile, shade in ((DAY, 200), (NIGHT, 40)):
        path = folder / "materials" / f"{profile[0]}.mp4"
        encode([np.full((36, 64, 3), shade, np.uint8)] * 5, path, size=(64, 36), fps=25)
        clips[profile] = Clip(
            profile[0], profile[0], f"materials/{path.name}", 0.2, (64, 36), "25", "", 60.0
        )
    lists = build_playlists(trials, order="as_written", count=None, parts=1, repeat=1, seed=0)
    levels = {"light": ("day", "night")}
    content = StudyContent(
        {"light": ""}, levels, clips, trials, lists, WORDS, None, jspsych, screen=screen
    )
    if cards:
        content = replace(content, cards=write_cards(folder, content))
    if packages:
        shutil.copytree(PACKAGES, folder / "node_modules")
    write_jspsych(folder, content)


PRESS = (
    "(() => { const open = [...document.querySelectorAll('.jspsych-btn')].filter(b => !b.disabled);"
    " const found = open.find(b => b.textContent === '%s'); if (found) found.click();"
    " return !!found; })()"
)


def answers(address, *presses, card=None):
    """What the page records when somebody presses these buttons, each as soon as it is open."""
    with Browser() as browser:
        page = browser.open(f"{address}/index.html?playlist=1&participant=7&save=no")
        page.wait_for("!!document.querySelector('.jspsych-btn')")
        page.click(".jspsych-btn")  # films only play by themselves after somebody has clicked
        if card is not None:
            page.wait_for("!!document.getElementById('size')")
            page.choose("#size", card)
            page.wait_for(PRESS % "OK")
        for words in presses:
            page.wait_for(PRESS % words)
        page.wait_for("'answers' in window")
        found = page.evaluate("window.answers.values()")
        assert not [error for error in page.errors if "favicon" not in error]
        loaded = [url for url in page.requests if url.endswith(".mp4")]
    return found, loaded


def test_films_are_preloaded_played_and_rated(tmp_path, address):
    study(tmp_path, single_trials([DAY, NIGHT]))
    found, loaded = answers(address, "3", "1")
    assert len(loaded) == len(set(loaded)) == 2
    assert [(a["light"], a["answer"], a["position"]) for a in found] == [
        ("day", "3", 1),
        ("night", "1", 2),
    ]
    # No button is open before the film has ended.
    assert all(a["rt"] >= 150 and a["participant"] == "7" for a in found)


def test_films_of_a_choice_are_shown_one_after_the_other(tmp_path, address):
    trials = (Trial("1", "1", (DAY, NIGHT, None)), Trial("1", "2", (NIGHT, DAY, None)))
    study(tmp_path, trials)
    found, _ = answers(address, "B", "None")
    assert [(a["light_1"], a["light_2"], a["answer"], a["chosen"]) for a in found] == [
        ("day", "night", 2, "night"),
        ("night", "day", 3, ""),
    ]


def test_films_are_as_wide_as_the_angle_of_their_lens(tmp_path, address):
    study(tmp_path, single_trials([DAY]), Screen(0.3, 10.0, "card"))
    (found,), _ = answers(address, "2")
    # 2 x 30 cm x tan(30 deg) x 10 px/cm
    assert found["video_width"] == pytest.approx(346.4, abs=1)


def test_a_bank_card_tells_how_large_pixels_are(tmp_path, address):
    study(tmp_path, single_trials([DAY]), Screen(0.3, None, "card"))
    (found,), _ = answers(address, "2", card=214)
    assert found["px_per_cm"] == pytest.approx(25.0)
    assert found["video_width"] == pytest.approx(866.0, abs=1)


def test_a_card_shows_all_films_at_once(tmp_path, address):
    trials = (Trial("1", "1", (DAY, NIGHT, None)), Trial("1", "2", (NIGHT, DAY, None)))
    study(tmp_path, trials, cards=True)
    found, loaded = answers(address, "B", "None")
    assert sorted(url.rpartition("/")[2] for url in loaded) == ["b1t1.mp4", "b1t2.mp4"]
    assert [(a["light_1"], a["answer"], a["chosen"]) for a in found] == [
        ("day", 2, "night"),
        ("night", 3, ""),
    ]


@pytest.mark.parametrize("place", ["node_modules/", "http://127.0.0.1:9/"])
def test_without_jspsych_the_page_says_so_in_one_sentence(tmp_path, address, place):
    """A folder that nobody filled, and an address that does not answer."""
    study(tmp_path, single_trials([DAY]), jspsych=place, packages=False)
    with Browser() as browser:
        page = browser.open(f"{address}/index.html?playlist=1&save=no")
        page.wait_for("document.readyState === 'complete'")
        said = page.evaluate("document.body.innerText.trim()")
    assert said.startswith("Nothing is shown, because jsPsych could not be loaded from ")
    assert place in said and said.endswith("?") and ". " not in said
