"""The viewer in notebooks, and what is said where it cannot run."""

from __future__ import annotations

import subprocess
import sys
import urllib.error
import urllib.request
from html.parser import HTMLParser

import pytest
from builders import write_scenario
from needed import package

import sumo3dviz_pt as sv
from sumo3dviz_pt.viewer.notebook import Choices

package("aiohttp")


class Frames(HTMLParser):
    """Collects the attributes of elements by name."""

    def __init__(self, text):
        super().__init__()
        self.found = {}
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found[tag] = dict(attrs)


def fetched(address):
    with urllib.request.urlopen(address, timeout=20) as answer:
        return answer.status, answer.read().decode()


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return sv.load(write_scenario(tmp_path_factory.mktemp("notebook")))


@pytest.mark.slow
def test_a_scene_is_viewed_until_it_is_closed(scene):
    with scene.view(size=(64, 36), start=2.0, end=4.0, height=500) as viewer:
        shown = Frames(viewer._repr_html_()).found
        assert shown["iframe"]["src"] == shown["a"]["href"] == viewer.address
        assert shown["iframe"]["height"] == "500" and shown["iframe"]["title"]
        assert viewer.address.startswith("http://127.0.0.1:") and viewer.running
        status, page = fetched(viewer.address)
        assert status == 200 and "<html" in page
        with pytest.raises(urllib.error.HTTPError, match="404"):
            fetched(viewer.address.replace(viewer.address.split("/")[3], "guess"))
        assert repr(viewer) == f"<Viewer at {viewer.address}>"
    assert not viewer.running
    assert "closed" in viewer._repr_html_() and "iframe" not in viewer._repr_html_()
    assert "closed" in repr(viewer)
    viewer.close()
    with pytest.raises(urllib.error.URLError):
        fetched(viewer.address)


@pytest.mark.parametrize(
    ("hub", "proxy", "way"),
    [
        (None, None, ""),
        ("/user/me/", None, "/user/me/proxy/{port}/"),
        ("/user/me/", "", ""),
        (None, "/proxy/{port}/", "/proxy/{port}/"),
    ],
)
def test_a_notebook_server_passes_the_page_on(monkeypatch, hub, proxy, way):
    monkeypatch.delenv("JUPYTERHUB_SERVICE_PREFIX", raising=False)
    if hub is not None:
        monkeypatch.setenv("JUPYTERHUB_SERVICE_PREFIX", hub)
    assert Choices(proxy=proxy).way == way


@pytest.mark.slow
def test_the_frame_shows_the_page_below_the_notebook_server(scene):
    with scene.view(size=(64, 36), start=2.0, end=4.0, proxy="/user/me/proxy/{port}/") as viewer:
        _, user, me, proxy, port, token, _ = viewer.address.split("/")
        assert (user, me, proxy) == ("user", "me", "proxy")
        assert Frames(viewer._repr_html_()).found["iframe"]["src"] == viewer.address
        # What the notebook's server asks us then, with the browser's own headers.
        asked = urllib.request.Request(
            f"http://127.0.0.1:{port}/{token}/",
            headers={"Host": "hub.example", "Origin": "https://hub.example"},
        )
        assert fetched(asked)[0] == 200


def test_wrong_choices_are_refused(scene):
    with pytest.raises(sv.ConfigError, match="llvm or cuda"):
        scene.view(variant="scalar")
    with pytest.raises(sv.InputError, match="from 1000 s on; the log goes from 0 s to 12 s"):
        scene.view(start=1000.0)


def test_other_templates_keep_a_scenes_own_settings(tmp_path):
    file = write_scenario(tmp_path)
    loaded = sv.load(file, {"seed": "11"})
    assert loaded._source.job({"template": "city_night"}).seed == 11
    assert loaded._source.job({"template": "city_night"}).template == "city_night"
    made = sv.Scene(network="a.net.xml", trajectories="b.xml", seed=12)
    assert made._source.job({"template": "city_night"}).seed == 12
    assert made._source.file is None and loaded._source.file == file


def test_without_the_extra_one_sentence_says_what_to_install(tmp_path):
    file = write_scenario(tmp_path)
    code = (
        "import sys; sys.modules['aiohttp'] = None\n"
        "import sumo3dviz_pt as sv\n"
        f"scene = sv.load({str(file)!r})\n"
        "try: scene.view()\n"
        "except sv.ConfigError as error: print(error)\n"
        "print('mitsuba' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    sentence, loaded = done.stdout.splitlines()
    assert 'pip install ".[viewer]"' in sentence and "aiohttp" in sentence
    assert loaded == "False"
