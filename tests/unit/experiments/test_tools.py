"""The files of tools: in each tool's own form, and sound whatever words they hold."""

from __future__ import annotations

import ast
import csv
import hashlib
import html.parser
import io
import json
import keyword
import re
from collections import Counter
from dataclasses import replace

import pytest
import yaml

from sumo3dviz_pt.experiments.tools.build import ONLINE, WRITERS, write_tools
from sumo3dviz_pt.experiments.tools.jspsych import PACKAGES, page
from sumo3dviz_pt.experiments.tools.papers import (
    citation,
    write_checksums,
    write_citation,
    write_inputs,
)
from sumo3dviz_pt.job.study import TOOLS


def rows(path, separator=","):
    text = path.read_text(encoding="utf-8-sig")
    return list(csv.DictReader(io.StringIO(text), delimiter=separator))


def both(*fixtures):
    return pytest.mark.parametrize("name", fixtures or ("ratings", "choices"))


@pytest.fixture
def content(request, name):
    return request.getfixturevalue(name)


def test_there_is_a_writer_for_every_tool_of_the_study_file():
    assert set(WRITERS) == set(TOOLS)


@both()
def test_all_files_are_said_and_there(tmp_path, content):
    files = write_tools(tmp_path, content, TOOLS)
    assert len(set(files)) == len(files) and all(path.stat().st_size for path in files)
    there = {p for p in tmp_path.rglob("*") if p.is_file()} - {*(tmp_path / "materials").iterdir()}
    assert there == set(files)


def test_tools_that_need_an_address_are_left_out_without_one(tmp_path, ratings):
    names = {path.name for path in write_tools(tmp_path, ratings, sorted(ONLINE))}
    assert not any("limesurvey" in name or "qualtrics" in name for name in names)


# Psych-DS ----------------------------------------------------------------------------------


DATA = re.compile(r"([a-z]+-[a-zA-Z0-9]+)(_[a-z]+-[a-zA-Z0-9]+)*_data\.csv")


@both()
def test_psychds_names_and_columns(tmp_path, content):
    write_tools(tmp_path, content, ["psychds"])
    described = json.loads((tmp_path / "dataset_description.json").read_text("utf-8"))
    assert described["@type"] == "Dataset" and described["@context"] == "https://schema.org/"
    assert {"name", "description", "variableMeasured"} <= described.keys()
    named = [variable["name"] for variable in described["variableMeasured"]]
    columns = set()
    for path in (tmp_path / "data").iterdir():
        assert DATA.fullmatch(path.name)
        found = rows(path)
        assert found and None not in found[0]
        columns |= set(found[0])
    assert set(named) == columns and len(named) == len(columns)
    assert all(variable["description"] for variable in described["variableMeasured"])


def test_trials_stand_in_rows_by_alternative(tmp_path, choices):
    write_tools(tmp_path, choices, [])
    (path,) = (tmp_path / "data").glob("*description-trials*")
    found = rows(path)
    assert len(found) == 12
    first, _, third = found[:3]
    assert (first["block"], first["task"], first["alternative"]) == ("1", "1", "1")
    assert (first["light"], first["gap"], first["none"]) == ("day", "1.5", "0")
    assert (third["none"], third["film"], third["light"]) == ("1", "", "")


@both()
def test_every_film_of_a_table_is_there(tmp_path, content):
    write_tools(tmp_path, content, [])
    for path in (tmp_path / "data").iterdir():
        for row in rows(path):
            films = [cell for key, cell in row.items() if re.fullmatch(r"film(_\d+)?", key)]
            assert films and all((tmp_path / film).is_file() for film in films if film)


# PsychoPy ----------------------------------------------------------------------------------


@both()
def test_psychopy_columns_are_variables_and_lists_are_balanced(tmp_path, content):
    files = WRITERS["psychopy"](tmp_path, content)
    assert len(files) == 1 + len(content.playlists)
    for path in files:
        found = rows(path)
        assert all(name.isidentifier() and not keyword.iskeyword(name) for name in found[0])
        assert all(
            (tmp_path / cell).is_file()
            for row in found
            for key, cell in row.items()
            if key.startswith("film") and cell
        )
    places = Counter(
        (row["block"], row["task"], row["position"]) for path in files[1:] for row in rows(path)
    )
    assert set(places.values()) == {1}


# jsPsych -----------------------------------------------------------------------------------


class Reader(html.parser.HTMLParser):
    """Scripts, links and title of a page."""

    def __init__(self, text):
        super().__init__()
        self.sources, self.texts, self._open = [], {}, None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.sources += [found[key] for key in ("src", "href") if key in found]
        self._open = found.get("id", tag)

    def handle_data(self, data):
        self.texts[self._open] = self.texts.get(self._open, "") + data


@both()
def test_the_page_holds_every_trial_and_preloads_by_film(content):
    found = Reader(page(content))
    study = json.loads(found.texts["study"])
    assert found.texts["title"].strip() == study["words"]["title"] == content.words.title
    assert set(study["films"]) == {clip.name for clip in content.films}
    assert len(study["trials"]) == len(content.trials)
    for playlist in content.playlists:
        assert len(study["playlists"][playlist.name]) == len(playlist.trials)
    for trial in study["trials"].values():
        assert all(film is None or film in study["films"] for film in trial["films"])
    assert "jsPsychPreload" in page(content)


def test_answers_carry_the_levels_of_what_was_seen(choices):
    study = json.loads(Reader(page(choices)).texts["study"])
    data = study["trials"]["b1t1"]["data"]
    assert (data["light_1"], data["light_2"], data["gap_2"]) == ("day", "night", "1.5")


@pytest.mark.parametrize(
    ("base", "first"),
    [
        ("https://unpkg.com/", f"https://unpkg.com/jspsych@{PACKAGES['jspsych']}/dist/"),
        ("node_modules/", "node_modules/jspsych/dist/"),
    ],
)
def test_jspsych_comes_from_an_address_or_a_folder(tmp_path, ratings, base, first):
    sources = Reader(page(replace(ratings, jspsych=base))).sources
    assert len(sources) == len(PACKAGES) + 1 and sources[0].startswith(first)


def test_what_comes_from_an_address_is_checked(ratings):
    """Every script and style has a digest of its own; files of one's own folder need none."""
    head = page(ratings).partition("</head>")[0]
    loaded = re.findall(r"<(?:script|link)[^>]*(?:src|href)=[^>]*>", head)
    digests = {re.search(r'integrity="sha384-([A-Za-z0-9+/]{64})"', one)[1] for one in loaded}
    assert len(digests) == len(loaded) == len(PACKAGES) + 1
    assert all('crossorigin="anonymous"' in one and "@" in one for one in loaded)
    assert "integrity" not in page(replace(ratings, jspsych="node_modules/"))


# Told factors ------------------------------------------------------------------------------


@both()
def test_what_films_do_not_show_is_told_in_words(tmp_path, content):
    """The gap has no words of its own, so its name is shown; it must not break out of HTML."""
    told = replace(content, told=("gap",), url="https://example.org/a/")
    told = replace(told, factors={"light": "", "gap": "a <b> gap"})
    study = json.loads(Reader(page(told)).texts["study"])
    assert {words for trial in study["trials"].values() for words in trial["told"]} <= {
        "a <b> gap: 1.5",
        "a <b> gap: 3",
        "",
    }
    write_tools(tmp_path, told, ["limesurvey", "qualtrics", "otree"])
    shown = sum(profile is not None for trial in told.trials for profile in trial.alternatives)
    for name in ("limesurvey.txt", "qualtrics.txt"):
        text = (tmp_path / name).read_text("utf-8")
        assert text.count("<p>a &lt;b&gt; gap: ") == shown
    otree = json.loads((tmp_path / "otree" / "films" / "study.json").read_text("utf-8"))
    assert otree["told"] == {"gap": "a <b> gap"}


def test_films_that_show_all_have_no_words(ratings):
    study = json.loads(Reader(page(ratings)).texts["study"])
    assert {words for trial in study["trials"].values() for words in trial["told"]} == {""}


# BIDS --------------------------------------------------------------------------------------


def test_bids_lists_films_under_the_names_of_the_draft(tmp_path, ratings):
    WRITERS["bids"](tmp_path, ratings)
    here = tmp_path / "bids" / "stimuli"
    found = rows(here / "stimuli.tsv", "\t")
    assert [row["stim_id"] for row in found] == ["stim-s040", "stim-s070", "stim-s100", "stim-s130"]
    for row, clip in zip(found, ratings.films, strict=True):
        assert re.fullmatch(r"stim-[0-9a-zA-Z]+_video\.mp4", row["stim_file"])
        assert hashlib.sha256((here / row["stim_file"]).read_bytes()).hexdigest() == clip.digest
    assert (
        "draft" in json.loads((here / "stimuli.json").read_text("utf-8"))["stim_id"]["Description"]
    )


def test_bids_can_be_written_again(tmp_path, ratings):
    assert WRITERS["bids"](tmp_path, ratings) == WRITERS["bids"](tmp_path, ratings)


# Surveys -----------------------------------------------------------------------------------


def test_limesurvey_nests_answers_in_questions_in_groups(tmp_path, choices):
    (path,) = WRITERS["limesurvey"](tmp_path, choices)
    assert path.read_bytes().startswith(b"\xef\xbb\xbf")
    found = rows(path, "\t")
    classes = [row["class"] for row in found]
    assert classes[:3] == ["S", "S", "SL"]
    questions = [row for row in found if row["class"] == "Q"]
    assert len(questions) == 1 + len(choices.trials)
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9]*", row["name"]) for row in questions)
    assert questions[0]["text"] == "{if(is_empty(block), rand(1, 2), block)}"
    groups = [row["relevance"] for row in found if row["class"] == "G"]
    assert groups == ["", "block == 1", "block == 1", "block == 2", "block == 2"]
    answers = [row for row in found if row["class"] == "A"]
    assert len(answers) == 3 * len(choices.trials)
    assert [row["text"] for row in answers[:3]] == ["A", "B", "None of these"]
    assert questions[1]["text"].count("<video ") == 2
    assert "https://example.org/study/materials/day_1.5.mp4" in questions[1]["text"]
    assert all("\n" not in cell for row in found for cell in row.values())


def test_braces_of_words_are_no_expressions_of_limesurvey(tmp_path, ratings):
    """It computes what stands in braces, unless a blank follows the first one."""
    words = replace(
        ratings.words, question="How {safe}?", answers=("{1}", "2"), low="{a", high="b}"
    )
    told = replace(ratings, words=words, url="https://example.org/a/", told=("gap",))
    told = replace(told, factors={"light": "", "gap": "{gap}"})
    (path,) = WRITERS["limesurvey"](tmp_path, told)
    found = rows(path, "\t")
    assert not [cell for row in found for cell in row.values() if re.search(r"\{\S", cell)]
    assert found[2]["text"] == "Gaps & lights: </script> { study}"
    assert (
        "How &#123;safe&#125;?" in found[4]["text"] and "&#123;gap&#125;: 1.5" in found[4]["text"]
    )


def test_limesurveys_codes_are_short_enough(tmp_path, ratings):
    """Its tables hold 5 characters of an answer's code and 20 of a question's."""
    many = replace(ratings.words, answers=tuple(map(str, range(1, 102))))
    (path,) = WRITERS["limesurvey"](tmp_path, replace(ratings, words=many, url="https://a.b/"))
    for row in rows(path, "\t"):
        limit = {"A": 5, "Q": 20}.get(row["class"])
        assert limit is None or re.fullmatch(rf"[A-Za-z][A-Za-z0-9]{{,{limit - 1}}}", row["name"])


def test_qualtrics_has_a_block_for_each_of_the_designs_and_a_page_for_each_trial(tmp_path, choices):
    text, loop = WRITERS["qualtrics"](tmp_path, choices)
    lines = text.read_text("utf-8").splitlines()
    assert lines[0] == "[[AdvancedFormat]]"
    assert lines.count("[[Block:Block 1]]") == lines.count("[[Block:Block 2]]") == 1
    assert lines.count("[[PageBreak]]") == 2
    assert lines.count("[[Question:MC:SingleAnswer:Horizontal]]") == 4
    after = lines[lines.index("[[Choices]]") + 1 :][:3]
    assert after == ["A", "B", "None of these"]
    found = rows(loop)
    assert found[0]["url_1"] == "https://example.org/study/materials/day_1.5.mp4"
    assert found[0]["url_3"] == ""


def test_words_cannot_break_out_of_html(tmp_path, ratings):
    files = write_tools(tmp_path, replace(ratings, url="https://example.org/a/"), TOOLS)
    for path in files:
        if path.name in ("limesurvey.txt", "qualtrics.txt"):
            text = path.read_text("utf-8")
            assert "<safe>" not in text and "&lt;safe&gt; &amp; sound?" in text


# oTree -------------------------------------------------------------------------------------


@both()
def test_otree_app_is_python_and_finds_its_films(tmp_path, content):
    WRITERS["otree"](tmp_path, content)
    here = tmp_path / "otree" / "films"
    for name in ("__init__.py", "tests.py"):
        ast.parse((here / name).read_text("utf-8"))
    study = json.loads((here / "study.json").read_text("utf-8"))
    found = rows(here / "playlists.csv")
    assert set(study["film_columns"]) <= set(found[0])
    first = found[0][study["film_columns"][0]]
    assert first.startswith("https://example.org/study/materials/" if study["online"] else "films/")


# Citation, digests -------------------------------------------------------------------------


def test_citations_are_yaml_whatever_the_words(tmp_path, ratings):
    path = write_citation(tmp_path, ratings.words, version="1.2")
    cited = yaml.safe_load(path.read_text("utf-8"))
    assert cited["title"] == ratings.words.title and cited["type"] == "dataset"
    assert cited["authors"] == [
        {"family-names": "Lovelace", "given-names": "Ada"},
        {"name": "Lab"},
    ]
    assert cited["references"][0]["version"] == "1.2"


def test_a_citation_without_authors_names_somebody(ratings):
    cited = yaml.safe_load(citation(replace(ratings.words, authors=(), licence=""), version="1"))
    assert cited["authors"] and "license" not in cited


def test_digests_are_those_of_the_files(tmp_path, ratings):
    files = write_tools(tmp_path, ratings, ["psychopy"])
    path = write_checksums(tmp_path, [*files, *(tmp_path / "materials").iterdir()])
    lines = [line.split("  ") for line in path.read_text("utf-8").splitlines()]
    assert [name for _, name in lines] == sorted(name for _, name in lines)
    assert len(lines) == len(files) + 4
    for digest, name in lines:
        assert digest == hashlib.sha256((tmp_path / name).read_bytes()).hexdigest()
    again = write_checksums(tmp_path, [*files, path, *(tmp_path / "materials").iterdir()])
    assert len(again.read_text("utf-8").splitlines()) == len(lines)
    assert len(write_inputs(tmp_path, files[:2]).read_text("utf-8").splitlines()) == 2
