"""What is no YAML is explained in our words, with its place; nothing in it grows without end."""

import time
import tracemalloc

import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.yaml12 import MOST_TEXT, MOST_VALUES, parse_yaml

RAW = (
    *("could not find", "mapping values", "expected <block end>", "token", "scanner", "alias '"),
    *("constructor", "codec", "found character", "flow", "stream", "anchor", "directive '"),
)
"""Words of PyYAML that nobody should have to read."""

FAULTS = {
    "no colon": ("a: 1\nb\nc: 2\n", "2:1", "no ': ' follows this key"),
    "two colons": ("a: b: c\n", "1:5", "a ':' may not stand here"),
    "indented too far": ("a: 1\n  b: 2\n", "2:4", "indent the line as those above"),
    "indented oddly": ("a:\n  - 1\n b: 2\n", "3:2", "this line does not fit those above"),
    "tab": ("a:\n\tb: 1\n", "2:1", "a tab stands here; indent with spaces"),
    "at": ("a: @x\n", "1:4", "no text begins with @ without quotes"),
    "open list": ("a: [1\n", "1:4", "a bracket is not closed by ]"),
    "open mapping": ("a: {b: 1\n", "1:4", "a bracket is not closed by }"),
    "open quote": ("a: 'x\nb: 1\n", "1:4", "a quote is opened here and closed nowhere"),
    "path of Windows": ('a: "C:\\path"\n', "1:4", "use single quotes, or / in paths"),
    "alias of nothing": ("a: *x\n", "1:4", "*x stands for what is marked by &x"),
    "mark twice": ("a: &x 1\nb: &x 2\n", "1:4", "&x marks two things"),
    "star": ("a: *\n", "1:4", "a * or & has a meaning of its own"),
    "merge of a number": ("<<: 3\n", "1:5", "<< lays a mapping into this one"),
    "dash": ("a: - b\n", "1:4", "a list's '-' may not stand here"),
    "second document": ("a: 1\n---\nb: 2\n", "2:1", "a second document begins here"),
    "tag of ours": ("a: !x y\n", "1:4", "the tag '!x' has no meaning here"),
    "tag of Python": ("a: !!python/name:os.system\n", "1:4", "has no meaning here"),
    "tag of YAML 1.1": ("a: !!timestamp 2026-06-21\n", "1:4", "'timestamp' has no meaning here"),
    "wrong tag": ("a: !!int abc\n", "1:4", "'abc' is not what its tag 'int' says"),
    "wrong truth": ("a: !!bool 3\n", "1:4", "'3' is not what its tag 'bool' says"),
    "key is a list": ("? [1, 2]\n: 3\n", "1:3", "a key is a word"),
    "NUL": ("a: b\nc: \0d\n", "2:4", "the character '\\x00' stands here"),
    "half a character": ('a: "\\ud800"\n', "1:4", "half a character stands here"),
    "5000 digits": ("a: " + "9" * 5000, "1:4", "a number of 5000 characters"),
    "5000 hexadecimal digits": ("a: 0x" + "f" * 5000, "1:4", "a number of 5002 characters"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults_are_explained_with_their_place(name):
    text, place, words = FAULTS[name]
    with pytest.raises(ConfigError) as caught:
        parse_yaml(text, file="scene.yaml")
    said = str(caught.value)
    assert said.startswith(f"scene.yaml:{place}: ") and words in said
    assert "\n" not in said and len(said) < 250
    assert not [word for word in RAW if word in said]


BOMBS = {
    "aliases": "a: &a [x, x, x, x, x, x, x, x, x]\n"
    + "".join(
        f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n"
        for a, b in zip("abcdefgh", "bcdefghi", strict=True)
    ),
    "merges": "a: &a {x: 1, y: 2}\n"
    + "".join(
        f"{b}: &{b} {{<<: [{', '.join([f'*{a}'] * 9)}], {b}{b}: 1}}\n"
        for a, b in zip("abcdefgh", "bcdefghi", strict=True)
    ),
    "itself": "a: &a [*a]",
    "itself as a mapping": "a: &a {b: *a}",
    "depth": "a: " + "[" * 30_000,
    "blocks": "".join("  " * k + "a:\n" for k in range(400)),
    "many": "a: [" + "x," * (MOST_VALUES + 1) + "]",
    "long": "#" * (MOST_TEXT + 1),
}


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name == "many" else []) for name in BOMBS],
)
def test_nothing_takes_time_without_end(name):
    began = time.process_time()
    with pytest.raises(ConfigError) as caught:
        parse_yaml(BOMBS[name], file="scene.yaml")
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 200
    assert time.process_time() - began < 60


# Following every allocation takes ten times as long: only where few words become many.
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in BOMBS if len(BOMBS[name]) < 10_000])
def test_few_words_do_not_fill_the_memory(name):
    tracemalloc.start()
    try:
        with pytest.raises(ConfigError):
            parse_yaml(BOMBS[name], file="scene.yaml")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 300e6


def test_aliases_share_nothing():
    value, _ = parse_yaml("a: &x {b: [1]}\nc: *x\n")
    value["a"]["b"].append(2)
    assert value["c"] == {"b": [1]}


def test_keys_are_text():
    assert parse_yaml("{-12: 1, true: 2, 1.5: 3, ~: 4, null: 5}")[0] == {
        "-12": 1,
        "true": 2,
        "1.5": 3,
        "~": 4,
        "null": 5,
    }


def test_tags_that_say_what_is_there_stay():
    assert parse_yaml("a: !!str 12\nb: !!float 3\nc: !!int 0o17")[0] == {
        "a": "12",
        "b": 3.0,
        "c": 15,
    }
