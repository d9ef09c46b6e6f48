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
from pathlib import Path

import pytest
import yaml

from sumo3dviz_pt.job.study import TOOLS
from sumo3dviz_pt.studies.tools import pages
from sumo3dviz_pt.studies.tools.content import StudySession
from sumo3dviz_pt.studies.tools.datasets import (
    citation,
    write_checksums,
    write_citation,
    write_inputs,
)
from sumo3dviz_pt.studies.tools.pages import SCRIPT, STYLE, VERSION, own_texts, page
from sumo3dviz_pt.studies.tools.surveys import WRITERS, survey_script, write_tools

ONLINE = {tool for tool, writer in WRITERS.items() if writer.online}


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
    files = WRITERS["psychopy"].write(tmp_path, content)
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
    assert found.texts["title"].strip() == study["title"] == content.words.title
    assert set(study["films"]) == {clip.name for clip in content.films}
    assert len(study["trials"]) == len(content.trials)
    for playlist in content.playlists:
        assert len(study["playlists"][playlist.name]) == len(playlist.trials)
    for trial in study["trials"].values():
        assert all(film is None or film in study["films"] for film in trial["films"])


def test_answers_carry_the_levels_of_what_was_seen(choices):
    study = json.loads(Reader(page(choices)).texts["study"])
    data = study["trials"]["b1t1"]["data"]
    assert (data["light_1"], data["light_2"], data["gap_2"]) == ("day", "night", "1.5")


@pytest.mark.parametrize(
    ("base", "first"),
    [
        ("https://unpkg.com/", f"https://unpkg.com/jspsych@{VERSION}/dist/"),
        ("node_modules/", "node_modules/jspsych/dist/"),
    ],
)
def test_jspsych_comes_from_an_address_or_a_folder(tmp_path, ratings, base, first):
    sources = Reader(page(replace(ratings, jspsych=base))).sources
    assert len(sources) == 2 and sources[0].startswith(first)


def test_what_comes_from_an_address_is_checked(ratings):
    """Every script and style has a digest of its own; files of one's own folder need none."""
    head = page(ratings).partition("</head>")[0]
    loaded = re.findall(r"<(?:script|link)[^>]*(?:src|href)=[^>]*>", head)
    digests = {re.search(r'integrity="sha384-([A-Za-z0-9+/]{64})"', one)[1] for one in loaded}
    assert len(digests) == len(loaded) == 2
    assert all('crossorigin="anonymous"' in one and "@" in one for one in loaded)
    assert "integrity" not in page(replace(ratings, jspsych="node_modules/"))


LANGUAGES = [language for language in own_texts() if language != "en"]


@pytest.mark.parametrize("language", LANGUAGES)
def test_languages_say_all_that_english_says(language):
    def keys(node):
        if isinstance(node, dict):
            return {key: keys(value) for key, value in node.items()}
        return [keys(each) for each in node] if isinstance(node, list) else type(node)

    assert keys(own_texts()[language]) == keys(own_texts()["en"])
    said, english = own_texts()[language]["page"], own_texts()["en"]["page"]
    assert all(
        re.findall(r"{\w+}", said[key]) == re.findall(r"{\w+}", english[key]) for key in said
    )


def test_pages_use_all_texts_and_no_others():
    """Those that the script asks for by name, or the survey's script does."""
    here = Path(pages.__file__).with_name("page")
    script = "".join(Path(here, name).read_text("utf-8") for name in ("film.js", "session.js"))
    used = set(re.findall(r"\bwords\.(\w+)", script))
    assert used | {"screen"} == set(own_texts()["en"]["page"])


def test_a_page_that_needs_no_network_has_jspsych_beside_it(tmp_path, ratings):
    there = tmp_path / "modules"
    for name in (SCRIPT, STYLE):
        (there / name).parent.mkdir(parents=True, exist_ok=True)
        (there / name).write_text(f"/* {name} */", "utf-8")
    session = StudySession(own_texts()["en"]["page"], offline=there)
    files = pages.write_jspsych(tmp_path, replace(ratings, session=session))
    sources = Reader(files[0].read_text("utf-8")).sources
    assert sources == [f"scripts/{SCRIPT}", f"scripts/{STYLE}"]
    assert all((tmp_path / source).read_bytes() for source in sources)
    assert not re.search(r"https?://(?!www\.w3)", files[0].read_text("utf-8"))


def test_films_are_muted_but_those_that_have_sound(tmp_path, ratings):
    """Browsers play silent films by themselves, and ask before those that are heard."""
    clips = {profile: replace(clip, heard=True) for profile, clip in ratings.clips.items()}
    for content, heard in ((ratings, False), (replace(ratings, clips=clips), True)):
        page = pages.write_jspsych(tmp_path, content)[0].read_text("utf-8")
        assert ('"heard": true' in page or '"heard":true' in page) == heard
        assert "muted: !film.heard" in page
        script = survey_script(content, None)
        assert ('"heard": true' in script) == heard and "muted: !STUDY.heard" in script


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
    blocks = len({trial.block for trial in told.trials})
    films = shown_in_surveys(tmp_path).values()
    told = [film["told"] for trials in films for trial in trials for film in trial]
    assert sum(words.startswith("a <b> gap: ") for words in told) == shown * len(films) / blocks
    otree = json.loads((tmp_path / "otree" / "films" / "study.json").read_text("utf-8"))
    assert otree["told"] == {"gap": "a <b> gap"}


def test_films_that_show_all_have_no_words(ratings):
    study = json.loads(Reader(page(ratings)).texts["study"])
    assert {words for trial in study["trials"].values() for words in trial["told"]} == {""}


# BIDS --------------------------------------------------------------------------------------


def test_bids_lists_films_under_the_names_of_the_draft(tmp_path, ratings):
    WRITERS["bids"].write(tmp_path, ratings)
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
    assert WRITERS["bids"].write(tmp_path, ratings) == WRITERS["bids"].write(tmp_path, ratings)


# Surveys -----------------------------------------------------------------------------------


def shown_in_surveys(folder):
    """The films of each playlist, as the script of both surveys knows them."""
    first = (folder / "survey.js").read_text("utf-8").partition("\n")[0]
    return json.loads(first.removeprefix("const STUDY = ").removesuffix(";"))["playlists"]


@both()
def test_surveys_show_everybody_one_playlist_in_its_order(tmp_path, content):
    """A question for each place in it, and nothing of which trial that is."""
    content = replace(content, url="https://example.org/study/")
    table, script = WRITERS["limesurvey"].write(tmp_path, content)
    text, again = WRITERS["qualtrics"].write(tmp_path, content)
    assert script == again and script.name == "survey.js"
    found = shown_in_surveys(tmp_path)
    for playlist in content.playlists:
        films = [[film["address"] for film in trial] for trial in found[playlist.name]]
        assert films == [
            ["" if p is None else f"{content.url}{content.clips[p].file}" for p in t.alternatives]
            for t in playlist.trials
        ]
    places = max(len(playlist.trials) for playlist in content.playlists)
    numbers = [f'data-position="{place}"' for place in range(1, places + 1)]
    for path in (table, text):
        written = path.read_text("utf-8").replace('""', '"')
        assert re.findall(r'data-position="\d+"', written) == numbers
        assert f'<script src="{content.url}survey.js">' in written


def test_limesurvey_nests_answers_in_questions_in_groups(tmp_path, choices):
    path, _ = WRITERS["limesurvey"].write(tmp_path, choices)
    assert path.read_bytes().startswith(b"\xef\xbb\xbf")
    found = rows(path, "\t")
    classes = [row["class"] for row in found]
    assert classes[:3] == ["S", "S", "SL"]
    questions = [row for row in found if row["class"] == "Q"]
    assert [row["name"] for row in questions] == ["playlist", "q1", "q2"]
    assert questions[0]["text"] == "{if(is_empty(playlist), rand(1, 4), playlist)}"
    assert 'data-playlist="{playlist}"' in questions[1]["text"]
    answers = [row for row in found if row["class"] == "A"]
    assert [row["text"] for row in answers[:3]] == ["A", "B", "None of these"]
    assert len(answers) == 6
    assert all("\n" not in cell for row in found for cell in row.values())


def test_shorter_playlists_of_limesurvey_end_before(tmp_path, choices):
    lists = [replace(choices.playlists[0], name=str(n + 1)) for n in range(4)]
    lists[1] = replace(lists[1], trials=lists[1].trials[:1])
    path, _ = WRITERS["limesurvey"].write(tmp_path, replace(choices, playlists=lists))
    groups = [row["relevance"] for row in rows(path, "\t") if row["class"] == "G"]
    last = "(playlist >= 1 and playlist <= 1) or (playlist >= 3 and playlist <= 4)"
    assert groups == ["", "", last]


def test_braces_of_words_are_no_expressions_of_limesurvey(tmp_path, ratings):
    """It computes what stands in braces, unless a blank follows the first one."""
    words = replace(
        ratings.words, question="How {safe}?", answers=("{1}", "=2"), low="{a", high="b}"
    )
    path, _ = WRITERS["limesurvey"].write(
        tmp_path, replace(ratings, words=words, url="https://a.b/")
    )
    found = rows(path, "\t")
    cells = {cell.replace("{playlist}", "") for row in found for cell in row.values()}
    assert [cell for cell in cells if re.search(r"\{\S", cell)] == [found[4]["text"]]
    assert found[4]["text"].startswith("{if(is_empty(playlist)")
    assert found[2]["text"] == "Gaps & lights: </script> { study}"
    assert "How &#123;safe&#125;?" in found[6]["text"] and found[8]["text"] == "&#61;2"


def test_limesurveys_codes_are_short_enough(tmp_path, ratings):
    """Its tables hold 5 characters of an answer's code and 20 of a question's."""
    many = replace(ratings.words, answers=tuple(map(str, range(1, 102))))
    path, _ = WRITERS["limesurvey"].write(
        tmp_path, replace(ratings, words=many, url="https://a.b/")
    )
    for row in rows(path, "\t"):
        limit = {"A": 5, "Q": 20}.get(row["class"])
        assert limit is None or re.fullmatch(rf"[A-Za-z][A-Za-z0-9]{{,{limit - 1}}}", row["name"])


def test_qualtrics_has_a_page_for_each_place_of_a_playlist(tmp_path, choices):
    text, _ = WRITERS["qualtrics"].write(tmp_path, choices)
    lines = text.read_text("utf-8").splitlines()
    assert lines[0] == "[[AdvancedFormat]]" and "[[ED:playlist]]" in lines
    assert lines.count("[[PageBreak]]") == 1
    assert lines.count("[[Question:MC:SingleAnswer:Horizontal]]") == 2
    after = lines[lines.index("[[Choices]]") + 1 :][:3]
    assert after == ["A", "B", "None of these"]


def test_tables_hold_no_formulas(tmp_path, ratings):
    """Whatever levels and words are called; numbers stay numbers."""
    names = {"day": "=1+1", "night": "-x", "1.5": "+3", "3": "-2.5"}
    clips = {tuple(names[each] for each in p): clip for p, clip in ratings.clips.items()}
    trials = [replace(t, alternatives=(tuple(clips)[n],)) for n, t in enumerate(ratings.trials)]
    lists = [replace(each, trials=tuple(trials)) for each in ratings.playlists]
    content = replace(ratings, clips=clips, trials=trials, playlists=lists, url="https://a.b/")
    content = replace(content, levels={"light": ("=1+1", "-x"), "gap": ("+3", "-2.5")})
    tables = [p for p in write_tools(tmp_path, content, TOOLS) if p.suffix in (".csv", ".tsv")]
    assert len(tables) > 8
    lines = [line for path in tables for line in csv.reader(path.read_text("utf-8").splitlines())]
    cells = {cell for line in lines for cell in line}
    assert {"'=1+1", "'-x", "+3", "-2.5"} <= cells
    assert not [cell for cell in cells if re.match(r"[=+@\t\r-](?!\d)", cell)]


def test_words_cannot_break_out_of_html(tmp_path, ratings):
    files = write_tools(tmp_path, replace(ratings, url="https://example.org/a/"), TOOLS)
    for path in files:
        if path.name in ("limesurvey.txt", "qualtrics.txt"):
            text = path.read_text("utf-8")
            assert "<safe>" not in text and "&lt;safe&gt; &amp; sound?" in text


# oTree -------------------------------------------------------------------------------------


@both()
def test_otree_app_is_python_and_finds_its_films(tmp_path, content):
    WRITERS["otree"].write(tmp_path, content)
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
