"""A study's folder is a valid Psych-DS data set, whatever lies beside its tables."""

from __future__ import annotations

import json

import pytest
from psychds_rules import is_ignored, problems, unknown_files, unofficial_keywords

from sumo3dviz_pt.job.study import TOOLS
from sumo3dviz_pt.studies.tools.surveys import write_tools

BESIDE = (
    *("study.json", "study.yaml", "certificate.json", "certificate.html", "certificate/a.png"),
    *("report.json", "report.html", "report/films.csv", "contact_sheet.png", "thumbnails/a.png"),
    *("contact_sheet.html", "calibration/wedge.mp4", "CITATION.cff", "inputs.sha256"),
    *("checksums.sha256", "package.json", "package-lock.json"),
    *("node_modules/a/README.md", "node_modules/a/data/b_data.csv", "node_modules/a/empty.json"),
)
"""What a study, its tools and npm put beside the tables."""


@pytest.fixture(params=["ratings", "choices"])
def folder(request, tmp_path):
    """All files that a study's folder can hold."""
    content = request.getfixturevalue(request.param)
    write_tools(tmp_path, content, TOOLS)
    for name in BESIDE:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"" if "empty" in name else b"x")
    return tmp_path


def description(folder):
    return json.loads((folder / "dataset_description.json").read_text("utf-8"))


def test_the_folder_is_valid_and_every_file_is_known_or_ignored(folder):
    assert problems(folder) == []
    assert unknown_files(folder) == []
    assert unofficial_keywords(folder) == set()


def test_patterns_with_a_slash_inside_would_ignore_nothing():
    assert not is_ignored("report/films.csv", ["report/*", "/report/"])
    assert is_ignored("report/films.csv", ["report/"])
    assert not is_ignored("report.csv", ["report/"])


@pytest.mark.parametrize("key", ["@context", "@type", "name", "description", "variableMeasured"])
def test_a_description_that_lacks_a_key_is_found(folder, key):
    said = description(folder)
    del said[key]
    (folder / "dataset_description.json").write_text(json.dumps(said), "utf-8")
    assert any(key in problem or "TYPE" in problem for problem in problems(folder))


def test_a_column_that_nobody_explains_is_found(folder):
    said = description(folder)
    said["variableMeasured"] = [v for v in said["variableMeasured"] if v["name"] != "position"]
    said["variableMeasured"].append({"@type": "PropertyValue", "name": "mood"})
    (folder / "dataset_description.json").write_text(json.dumps(said), "utf-8")
    assert problems(folder) == [
        "CSV_COLUMN_MISSING_FROM_METADATA: position",
        "VARIABLE_MISSING_FROM_CSV_COLUMNS: mood",
    ]


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("Study-a_data.csv", "task\n1\n", "FILENAME_KEYWORD_FORMATTING_ERROR"),
        ("study-a_data.csv", "task,block\n1\n", "CSV_HEADER_LENGTH_MISMATCH"),
        ("study-a_data.csv", "task,task\n1,1\n", "CSV_HEADER_REPEATED"),
        ("study-a_data.csv", "", "CSV_HEADER_MISSING"),
    ],
)
def test_spoilt_tables_are_found(folder, name, text, found):
    (folder / "data" / name).write_text(text, "utf-8")
    assert [problem.partition(":")[0] for problem in problems(folder)] == [found]
