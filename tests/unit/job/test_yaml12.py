"""YAML by the 1.2 core schema, with places and without duplicates."""

import math

import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.yaml12 import parse_yaml


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("12:30", "12:30"),
        ("on", "on"),
        ("yes", "yes"),
        ("no", "no"),
        ("off", "off"),
        ("y", "y"),
        ("2026-06-21", "2026-06-21"),
        ("0o17", 15),
        ("017", 17),
        ("0x1F", 31),
        ("-7", -7),
        ("+7", 7),
        ("1_000", "1_000"),
        ("0b11", "0b11"),
        ("1e3", 1000.0),
        ("-1.5E-2", -0.015),
        (".5", 0.5),
        ("5.", 5.0),
        (".inf", math.inf),
        ("-.INF", -math.inf),
        ("+.inf", math.inf),
        ("true", True),
        ("FALSE", False),
        ("tRUE", "tRUE"),
        ("~", None),
        ("null", None),
        ("Null", None),
        ("nULL", "nULL"),
        ("'12'", "12"),
        ('"true"', "true"),
        ("", None),
        ("[a, , b]", ConfigError),
        ("[1, on, {a: 0x2}]", [1, "on", {"a": 2}]),
    ],
)
def test_core_schema(text, value):
    if value is ConfigError:
        with pytest.raises(ConfigError, match="not valid YAML"):
            parse_yaml(text)
        return
    found, _ = parse_yaml(text)
    assert found == value and type(found) is type(value)


def test_not_a_number():
    assert math.isnan(parse_yaml(".NaN")[0])


def test_empty_values_are_null():
    assert parse_yaml("a:\nb: 1")[0] == {"a": None, "b": 1}


def test_merge_keys():
    text = "base: &b {x: 1, y: 2}\nown: {<<: *b, y: 3}"
    assert parse_yaml(text)[0]["own"] == {"x": 1, "y": 3}


def test_places_of_keys_and_items():
    _, places = parse_yaml("a:\n  b: 1\n  c:\n    - x: 2\n    - 3\n")
    assert places == {
        ("a",): (1, 1),
        ("a", "b"): (2, 3),
        ("a", "c"): (3, 3),
        ("a", "c", 0): (4, 7),
        ("a", "c", 0, "x"): (4, 7),
        ("a", "c", 1): (5, 7),
    }


@pytest.mark.parametrize(
    ("text", "key", "line", "column"),
    [
        ("a: 1\na: 2\n", "a", 2, 1),
        ("a: {b: 1, b: 2}", "a.b", 1, 11),
        ("a:\n  - {c: 1}\n  - {c: 1, d: 2, c: 3}\n", "a.1.c", 3, 18),
        ('a: 1\n"a": 2\n', "a", 2, 1),
    ],
)
def test_duplicates_are_refused(text, key, line, column):
    with pytest.raises(ConfigError, match="stands twice, first in line") as caught:
        parse_yaml(text, file="s.yaml")
    error = caught.value
    assert (error.key, error.line, error.column) == (key, line, column)
    assert str(error).startswith(f"s.yaml:{line}:{column}: {key}: ")


@pytest.mark.parametrize("text", ["a: [1", "a: b: c", "\tx: 1", "a: 'x", "{a: 1}}", "--- 1\n--- 2"])
def test_broken_documents_name_the_place(text):
    with pytest.raises(ConfigError, match="not valid YAML") as caught:
        parse_yaml(text, file="s.yaml")
    assert caught.value.line is not None and caught.value.column is not None


def test_control_characters_are_no_yaml():
    with pytest.raises(ConfigError, match="not valid YAML"):
        parse_yaml("a: \x01")


def test_tags_of_python_are_refused():
    with pytest.raises(ConfigError, match="not valid YAML"):
        parse_yaml("a: !!python/object/apply:os.getcwd []")


def test_endless_documents_are_refused():
    with pytest.raises(ConfigError, match="nested too deeply, or in itself"):
        parse_yaml("a: &a [*a]")


@pytest.mark.parametrize("text", ["How safe?", "a?b", "what?!", "is it so? or so?"])
def test_a_question_needs_no_quotes_in_brackets(text):
    assert parse_yaml(f"{{text: {text}, low: [{text}, b]}}")[0] == {
        "text": text,
        "low": [text, "b"],
    }
    assert parse_yaml(f"text: {text}")[0] == {"text": text}


def test_a_question_mark_alone_is_still_no_key():
    with pytest.raises(ConfigError):
        parse_yaml("? [a, b]\n: 3")
