"""Words of a study that could break the pages and tables which are written of it."""

import json
import re
from dataclasses import fields, replace

import pytest

from sumo3dviz_pt.studies.tools.pages import page
from sumo3dviz_pt.studies.tools.surveys import WRITERS

HOSTILE = (
    *("a <!--<script> b", "</script><script>alert(1)</script>", "<!--", "--> ]]> {study} {title}"),
    *("\"'`\\ \\u003c", "\u2028 \u2029 \x85", "<img src=x onerror=alert(1)>", "&lt;b&amp;"),
)
DATA = re.compile(r'<script type="application/json" id="study">(.*?)</script>', re.S)
MARKUP = re.compile(r"<(?!/script>)", re.I)


def spoilt(content, text):
    """A study all of whose words are a text."""
    words = {item.name: text for item in fields(content.words)}
    words |= {"language": "en", "answers": (text, "2"), "authors": (text,), "keywords": (text,)}
    told = dict.fromkeys(content.factors, text)
    return replace(content, words=replace(content.words, **words), factors=told)


@pytest.mark.parametrize("text", HOSTILE)
def test_the_page_shows_any_words(ratings, text):
    (data,) = DATA.findall(page(spoilt(ratings, text)))
    assert not MARKUP.search(data), "a script whose text opens another never ends"
    assert json.loads(data)["question"]["text"] == text
    assert page(spoilt(ratings, text)).count("<script") == page(ratings).count("<script")


@pytest.mark.parametrize("text", HOSTILE)
def test_pages_of_all_tools_hold_no_other_elements(tmp_path, choices, text):
    def elements(content):
        files = [path for writer in WRITERS.values() for path in writer.write(tmp_path, content)]
        pages = [path for path in files if path.suffix in (".html", ".lss", ".lsg", ".lsq")]
        found = [
            re.findall(r"<[a-zA-Z!][\w-]*", path.read_text(encoding="utf-8")) for path in pages
        ]
        return dict(zip([path.name for path in pages], found, strict=True))

    assert elements(spoilt(choices, text)) == elements(spoilt(choices, "harmless"))
