"""The example study, from its file by one command to answers that a browser records.

As `test_study_page.py`, it needs Chromium and a folder with jsPsych.
"""

from __future__ import annotations

import csv
import functools
import http.server
import json
import os
import threading
import time
from pathlib import Path
from typing import ClassVar

import pytest
from needed import skip_if
from psychds_rules import problems, unknown_files
from viewer.browser import Browser, chromium

from sumo3dviz_pt.catalog import data_root
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.studies.file import load_study

PACKAGES = Path(os.environ.get("SUMO3DVIZ_PT_NODE_MODULES", "no folder"))
STUDY = data_root("examples") / "crossing" / "study.yaml"
SMALL = ("quality=draft", "output.size=[64, 36]", "shots.0.to=453.12", "textured=false")
OPEN = (
    "(() => { const found = [...document.querySelectorAll('.jspsych-btn')].find("
    "b => !b.disabled && b.textContent === '%s'); if (found) found.click(); return !!found; })()"
)

pytestmark = pytest.mark.slow


class Plain(http.server.SimpleHTTPRequestHandler):
    """A plain web server that says nothing; one film is slow, and one is not there."""

    slow: ClassVar[str] = ""
    missing: ClassVar[str] = ""

    def log_message(self, *_: object) -> None:
        pass

    def do_GET(self) -> None:
        name = self.path.lstrip("/")
        if name == Plain.missing:
            self.send_error(404)
            return
        if name == Plain.slow:
            time.sleep(1.5)
        super().do_GET()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What one command makes of the example, small, with jsPsych in the folder."""
    place = tmp_path_factory.mktemp("example")
    text = STUDY.read_text(encoding="utf-8")
    scene = json.dumps(str(STUDY.with_name("scene.yaml")))
    assert "scene: scene.yaml\n" in text
    text = text.replace("scene: scene.yaml\n", f"scene: {scene}\n")
    here = json.dumps(f"{PACKAGES.resolve()}/") if PACKAGES.is_dir() else "node_modules/"
    tools = f"tools: {{offline: {json.dumps(PACKAGES.is_dir())}, jspsych: {here}}}\n"
    (place / "study.yaml").write_text(text + tools, "utf-8")
    words = [word for value in SMALL for word in ("--set", value)]
    done = main(["study", str(place / "study.yaml"), "-o", str(place / "out"), *words])
    assert done == 0
    return place / "out"


@pytest.fixture
def address(folder):
    """A web server in the study's folder, as it is."""
    handler = functools.partial(Plain, directory=folder)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    thread.join()
    server.server_close()


def test_one_command_makes_eight_films_that_differ(folder):
    record = json.loads((folder / "study.json").read_bytes())
    assert len(record["films"]) == 8
    assert len({film["sha256"] for film in record["films"].values()}) == 8
    assert record["notes"] == []
    assert [sum(p["factor"] == f for p in record["pairs"]) for f in record["factors"]] == [4, 4, 4]
    for name in record["films"]:
        account = json.loads((folder / "materials" / f"{name}.json").read_bytes())
        assert "vehicle:traffic_W_E.52" in account["frames"][0]["drawn"]
        assert (account["tone"], account["glare"]) == ("agx", 0.02)


def test_nothing_in_the_folder_points_out_of_it(folder):
    (table,) = (folder / "data").glob("*_description-stimuli_data.csv")
    with table.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 8
    assert all((folder / row["film"]).is_file() for row in rows)
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert str(folder) not in page
    assert "https://" not in page
    assert load_study(folder / "inputs" / "study.yaml").settings.tools.offline == PACKAGES.is_dir()


def test_the_folder_is_a_psychds_data_set(folder):
    assert problems(folder) == []
    assert unknown_files(folder) == []


@pytest.mark.skipif(not PACKAGES.is_dir(), reason="jsPsych is not here")
@skip_if(chromium() is None, "there is no Chromium on the PATH")
def test_a_browser_plays_all_films_and_records_the_answers(address):
    """From a plain web server, with a slow film and one that is not there."""
    with Browser() as browser:
        page = browser.open(f"{address}/index.html?participant=3&save=no")
        page.wait_for("!!document.querySelector('.jspsych-btn')")
        films = page.evaluate(
            "study.playlists['3'].map((each) => study.films[study.trials[each].films[0]].file)"
        )
        Plain.slow, Plain.missing = films[1], films[4]
        page.click(".jspsych-btn")  # films only play by themselves after somebody has clicked
        for number in range(8):
            page.wait_for(OPEN % ("Go on without it" if number == 4 else number % 7 + 1))
        page.wait_for("'answers' in window")
        found = [row for row in page.evaluate("window.answers") if row["row_kind"] == "answer"]
        asked = {url.rpartition("/")[2] for url in page.requests if url.endswith(".mp4")}
    assert len(asked) == 8
    given = [str(n % 7 + 1) if n != 4 else "" for n in range(8)]
    assert [answer["answer"] for answer in found] == given
    assert [answer["film_skipped"] for answer in found] == [int(n == 4) for n in range(8)]
    assert found[4]["film_problems"] == "missing" and found[1]["film_stalled"] == 0
    assert found[0]["film_loading_ms"] + found[1]["film_loading_ms"] >= 500
    assert all(answer["film_certified"] == 1 for answer in found if not answer["film_skipped"])
    profiles = {(a["light"], a["trees"], a["ahead"]) for a in found}
    assert len(profiles) == 8
    assert {a["playlist"] for a in found} == {"3"}
