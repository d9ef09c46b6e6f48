"""Design tables: each tool's own form is read, and bad tables are refused in one sentence."""

from pathlib import Path

import pytest
from needed import package

from sumo3dviz_pt.errors import ConfigError, InputError, MissingExtraError
from sumo3dviz_pt.studies.designs.cells import read_table
from sumo3dviz_pt.studies.designs.tables import TableRequest, trials_in
from sumo3dviz_pt.studies.designs.trials import Trial

LEVELS = {"light": ("day", "dusk", "night"), "trees": ("none", "some")}


def write(folder: Path, content: str | bytes, name: str = "design.csv") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def read(folder, content, *, levels=LEVELS, name="design.csv", separator="auto", **asked):
    table = read_table(write(folder, content, name), separator=separator)
    return trials_in(table, levels, TableRequest(**asked))


def complaint(folder, content, kind=InputError, **asked):
    with pytest.raises(kind) as caught:
        read(folder, content, **asked)
    text = str(caught.value)
    assert "\n" not in text
    return text


# Tools -------------------------------------------------------------------------------------


CBCTOOLS = """profileID,respID,qID,altID,obsID,light,trees,no_choice
4,1,1,1,1,day,some,0
3,1,1,2,1,night,none,0
0,1,1,3,1,0,0,1
2,1,2,1,2,dusk,none,0
6,1,2,2,2,night,some,0
0,1,2,3,2,0,0,1
1,2,1,1,3,day,none,0
5,2,1,2,3,dusk,some,0
0,2,1,3,3,0,0,1
3,2,2,1,4,night,none,0
4,2,2,2,4,day,some,0
0,2,2,3,4,0,0,1
"""


def test_cbctools_with_a_no_choice_option(tmp_path):
    trials = read(tmp_path, CBCTOOLS, form="cbctools")
    assert trials[0] == Trial("1", "1", (("day", "some"), ("night", "none"), None))
    assert [(trial.block, trial.task) for trial in trials] == [
        ("1", "1"),
        ("1", "2"),
        ("2", "1"),
        ("2", "2"),
    ]


def test_cbctools_with_dummy_codes(tmp_path):
    text = """profileID,respID,qID,altID,obsID,lightdusk,lightnight,treessome
1,1,1,1,1,0,0,0
5,1,1,2,1,1,0,1
3,1,2,1,2,0,1,0
4,1,2,2,2,0,0,1
"""
    columns = {"light": ("lightdusk", "lightnight"), "trees": ("treessome",)}
    codes = {"trees": {"0": "none", "1": "some"}}
    trials = read(tmp_path, text, form="cbctools", columns=columns, codes=codes)
    assert [trial.alternatives for trial in trials] == [
        (("day", "none"), ("dusk", "some")),
        (("night", "none"), ("day", "some")),
    ]


IDEFIX = """"","Var12","Var13","Var22"
"set1.alt1",0,0,1
"set1.alt2",1,0,0
"set2.alt1",0,1,1
"set2.alt2",0,0,0
"""
IDEFIX_COLUMNS = {"light": ("Var12", "Var13"), "trees": ("Var22",)}
IDEFIX_CODES = {"trees": {"0": "none", "1": "some"}}


def test_idefix_with_dummy_codes_and_row_names(tmp_path):
    trials = read(tmp_path, IDEFIX, form="idefix", columns=IDEFIX_COLUMNS, codes=IDEFIX_CODES)
    assert trials == (
        Trial("1", "1", (("day", "some"), ("dusk", "none"))),
        Trial("1", "2", (("night", "some"), ("day", "none"))),
    )


def test_idefix_as_r_writes_tables_without_a_header_of_row_names(tmp_path):
    text = IDEFIX.replace('"",', "", 1).replace(",", " ").replace(" ", "\t")
    trials = read(tmp_path, text, form="idefix", columns=IDEFIX_COLUMNS, codes=IDEFIX_CODES)
    assert trials[0].alternatives == (("day", "some"), ("dusk", "none"))


def test_idefix_with_effects_codes(tmp_path):
    text = """,Var11,Var12,Var21
set1.alt1,1,0,1
set1.alt2,-1,-1,-1
set2.alt1,0,1,-1
set2.alt2,1,0,-1
"""
    columns = {"light": ("Var11", "Var12"), "trees": ("Var21",)}
    codes = {"trees": {"1": "none", "-1": "some"}}
    trials = read(tmp_path, text, form="idefix", columns=columns, codes=codes)
    assert [trial.alternatives for trial in trials] == [
        (("day", "none"), ("night", "some")),
        (("dusk", "some"), ("day", "some")),
    ]


EFFECTS = ("Var11", "Var12")


def test_effects_codes_that_never_show_the_last_level_are_known_by_their_columns(tmp_path):
    """They were read as dummy codes: every level was another one."""
    text = ",Var11,Var12\nset1.alt1,1,0\nset1.alt2,0,1\n"
    levels = {"light": LEVELS["light"]}
    asked = {"form": "idefix", "levels": levels, "columns": {"light": EFFECTS}}
    (trial,) = read(tmp_path, text, **asked)
    assert trial.alternatives == (("day",), ("dusk",))
    dummies = text.replace("Var12", "Var13").replace("Var11", "Var12")
    asked["columns"] = {"light": ("Var12", "Var13")}
    (trial,) = read(tmp_path, dummies, **asked)
    assert trial.alternatives == (("dusk",), ("night",))


def test_a_choice_of_nothing_is_no_dummy_code(tmp_path):
    text = ",cte,Var11,Var12\nset1.alt1,0,1,0\nset1.alt2,0,-1,-1\nset1.no.choice,1,0,0\n"
    asked = {"form": "idefix", "levels": {"light": LEVELS["light"]}, "none": {"cte": "1"}}
    (trial,) = read(tmp_path, text, columns={"light": EFFECTS}, **asked)
    assert trial.alternatives == (("day",), ("night",), None)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("1,0\nset1.alt2,0,1", "neither rows of -1 nor rows of 0"),
        ("0,0\nset1.alt2,-1,-1", "rows of -1 and rows of 0"),
    ],
)
def test_codes_that_may_be_either_are_refused_until_it_is_said(tmp_path, rows, words):
    text = f",La,Lb\nset1.alt1,{rows}\n"
    asked = {"form": "idefix", "levels": {"light": LEVELS["light"]}}
    asked["columns"] = {"light": ("La", "Lb")}
    found = complaint(tmp_path, text, **asked)
    assert f"hold {words}, so they may be dummy or effects codes; say which" in found
    if "neither" in words:
        (trial,) = read(tmp_path, text, coding={"light": "effects"}, **asked)
        assert trial.alternatives == (("day",), ("dusk",))
        (trial,) = read(tmp_path, text, coding={"light": "dummy"}, **asked)
        assert trial.alternatives == (("dusk",), ("night",))


def test_large_tables_take_time_and_memory_by_their_rows(tmp_path):
    """Of 20,000 rows of codes each was held against all others."""
    kinds = ("0,0,0", "1,0,1", "0,1,0")
    rows = [f"set{n // 2}.alt{n % 2},{kinds[n % 3]}" for n in range(20_000)]
    trials = read(
        tmp_path,
        "\n".join([",Var12,Var13,Var22", *rows]) + "\n",
        form="idefix",
        columns=IDEFIX_COLUMNS,
        codes=IDEFIX_CODES,
    )
    assert len(trials) == 10_000


def test_idefix_decoded_and_with_a_no_choice_alternative(tmp_path):
    text = """,no.choice.cte,V1,V2
set1.alt1,0,day,some
set1.alt2,0,night,none
set1.alt3,1,NA,NA
"""
    columns = {"light": ("V1",), "trees": ("V2",)}
    trials = read(tmp_path, text, form="idefix", columns=columns, none={"no.choice.cte": "1"})
    assert trials == (Trial("1", "1", (("day", "some"), ("night", "none"), None)),)


def test_spdesign_in_wide_form_with_blocks(tmp_path):
    text = """alt1_x1,alt1_x2,alt2_x1,alt2_x2,alt3_sq,block
1,0,3,1,1,1
2,1,1,0,1,2
"""
    columns = {"light": ("{alt}_x1",), "trees": ("{alt}_x2",)}
    codes = {
        "light": {"1": "day", "2": "dusk", "3": "night"},
        "trees": {"0": "none", "1": "some"},
    }
    trials = read(
        tmp_path, text, form="spdesign", columns=columns, codes=codes, none={"alt3_sq": "1"}
    )
    assert trials == (
        Trial("1", "1", (("day", "none"), ("night", "some"), None)),
        Trial("2", "2", (("dusk", "some"), ("day", "none"), None)),
    )


def test_ngene_with_semicolons_and_decimal_commas(tmp_path):
    text = (
        "Choice situation;car.gap;car.trees;bike.gap;bike.trees;Block\r\n"
        "1;1,5;0;3;1;1\r\n"
        "2;3,0;1;1,5;0;2\r\n"
    )
    levels = {"gap": ("1.5", "3"), "trees": ("none", "some")}
    codes = {"trees": {"0": "none", "1": "some"}}
    trials = read(tmp_path, text, levels=levels, form="ngene", codes=codes)
    assert trials == (
        Trial("1", "1", (("1.5", "none"), ("3", "some"))),
        Trial("2", "2", (("3", "some"), ("1.5", "none"))),
    )


def test_sawtooth_numbers_levels_and_shares_fixed_tasks(tmp_path):
    text = """Version,Task,Concept,Att 1,Att 2
0,1,1,1,1
0,1,2,3,2
1,1,1,2,1
1,1,2,0,0
2,1,1,3,2
2,1,2,1,1
"""
    columns = {"light": ("Att 1",), "trees": ("Att 2",)}
    trials = read(tmp_path, text, form="sawtooth", columns=columns)
    assert trials == (
        Trial("1", "fixed1", (("day", "none"), ("night", "some"))),
        Trial("1", "1", (("dusk", "none"), None)),
        Trial("2", "fixed1", (("day", "none"), ("night", "some"))),
        Trial("2", "1", (("night", "some"), ("day", "none"))),
    )


def test_a_list_of_profiles_is_a_trial_for_each_row(tmp_path):
    trials = read(tmp_path, "light,trees\nday,none\nnight,some\n")
    assert [trial.alternatives for trial in trials] == [(("day", "none"),), (("night", "some"),)]


def test_wide_tables_may_name_their_alternatives(tmp_path):
    text = "task,light_left,light_right,light_far,trees_left,trees_right\na,day,night,x,none,some\n"
    columns = {"light": ("light_{alt}",), "trees": ("trees_{alt}",)}
    trials = read(tmp_path, text, form="wide", columns=columns, alternatives=("right", "left"))
    assert trials == (Trial("1", "a", (("night", "some"), ("day", "none"))),)


# Files -------------------------------------------------------------------------------------


PLAIN = "task,alternative,light,trees\n1,1,day,none\n1,2,night,some\n"


@pytest.mark.parametrize(
    "content",
    [
        PLAIN.encode("utf-8-sig"),
        PLAIN.encode("utf-16"),
        PLAIN.replace(",", ";").encode(),
        PLAIN.replace(",", "\t").encode(),
        PLAIN.replace("\n", "\r\n").encode(),
        PLAIN.replace(",", " , ").encode(),
        PLAIN.replace("\n", "\n\n").encode(),
        PLAIN.replace("light", '"light"').replace("day", '"day"').encode(),
        PLAIN.replace("light", " Light ").encode(),
    ],
    ids=["bom", "utf16", "semicolon", "tab", "crlf", "blanks", "gaps", "quotes", "capitals"],
)
def test_the_same_table_in_other_dress(tmp_path, content):
    assert read(tmp_path, content) == (Trial("1", "1", (("day", "none"), ("night", "some"))),)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "holds no table, it is empty"),
        ("light,trees\n", "holds a header and no rows"),
        (PLAIN.replace("trees", "bushes"), "no column is called 'trees', for the factor trees"),
        (
            PLAIN.replace("night", "nihgt"),
            ":3: column 'light': 'nihgt' is no level of light; did you",
        ),
        (PLAIN.replace("night", ""), ":3: column 'light': this cell is empty"),
        (PLAIN.replace("night", "NA"), ":3: column 'light': this cell is empty"),
        (
            PLAIN.replace("1,2,night,some", "1,1,day,none"),
            "alternative 1 a second time with the same",
        ),
        (PLAIN.replace("1,2,night", "1,1,night"), "alternative 1 a second time, first in line 2"),
        (PLAIN + "2,1,day,some\n", ":4: task 2 of block 1 has 1 alternatives and others have 2"),
        (PLAIN + "2,1,day\n", ":4: this row has 3 cells and the header 4"),
        ("light,gap\nday,1,5\n", "no column is called 'trees'"),
        ("light,trees\nday,1,5\nday,2\n", "decimal commas need quotes around them"),
        (PLAIN.replace("light", "trees"), "two columns are called 'trees'"),
        (PLAIN.replace("day", '"day'), "a quote is opened here and not closed"),
        (PLAIN.encode("latin-1").replace(b"day", b"t\xe4g"), "is no text in UTF-8"),
        (b"PK\x03\x04 and more", "is it an .xlsx by another name"),
        (b"a\0b,c\n1,2\n", "it holds null characters"),
    ],
)
def test_bad_tables_are_refused(tmp_path, content, words):
    assert words in complaint(tmp_path, content)


def test_a_wrong_separator_is_suspected(tmp_path):
    text = complaint(tmp_path, PLAIN, separator="semicolon")
    assert "no column is called 'light'" in text and "is the separator another one?" in text


def test_a_table_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="there is no such table"):
        read_table(tmp_path / "none.csv")


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"columns": {"lihgt": ("a",)}}, "design.columns.lihgt: no factor is called 'lihgt'; did"),
        ({"codes": {"light": {"1": "dya"}}}, "design.codes.light.1: light has no level 'dya'; did"),
        ({"columns": {"light": ("a", "b", "c")}}, "3 levels take one column, or 2 of codes, not 3"),
        ({"alternatives": ("a",)}, "only wide tables take alternatives"),
        ({"form": "wide", "columns": {"light": ("x",)}}, "a factor's column holds {alt}"),
    ],
)
def test_requests_that_do_not_fit_are_refused(tmp_path, asked, words):
    assert words in complaint(tmp_path, PLAIN, ConfigError, **asked)


def test_codes_that_are_none_are_refused(tmp_path):
    text = IDEFIX.replace("1,0,0\n", "1,1,0\n")
    found = complaint(tmp_path, text, form="idefix", columns=IDEFIX_COLUMNS, codes=IDEFIX_CODES)
    assert ":3: column 'Var12': 1, 1 are no dummy codes of light (design.coding" in found


def test_row_names_that_are_lost_are_missed(tmp_path):
    text = "n,Var12,Var13,Var22\n1,0,0,1\n"
    found = complaint(tmp_path, text, form="idefix", columns=IDEFIX_COLUMNS, codes=IDEFIX_CODES)
    assert "should be called like set1.alt1" in found


def test_cbctools_that_ends_within_a_question_is_refused(tmp_path):
    text = "".join(CBCTOOLS.splitlines(keepends=True)[:-1])
    found = complaint(tmp_path, text, form="cbctools")
    assert ":11: task 2 of block 2 has 2 alternatives and others have 3" in found


def test_spdesign_without_one_attribute_of_an_alternative_is_refused(tmp_path):
    text = "alt1_x1,alt1_x2,alt2_x1,block\n1,0,3,1\n"
    columns = {"light": ("{alt}_x1",), "trees": ("{alt}_x2",)}
    found = complaint(tmp_path, text, form="spdesign", columns=columns)
    assert "no column is called 'alt2_x2', for the factor trees" in found


def test_ngene_with_a_level_that_nobody_explained_is_refused(tmp_path):
    text = "Choice situation\tcar.light\tcar.trees\tBlock\n1\tday\t0\t1\n2\tnight\t2\t1\n"
    codes = {"trees": {"0": "none", "1": "some"}}
    found = complaint(tmp_path, text, form="ngene", codes=codes)
    assert ":3: column 'car.trees': '2' is no level of trees" in found


def test_a_level_out_of_range_is_refused(tmp_path):
    columns = {"light": ("Att 1",), "trees": ("Att 2",)}
    text = "Version,Task,Concept,Att 1,Att 2\n1,1,1,4,1\n"
    found = complaint(tmp_path, text, form="sawtooth", columns=columns)
    assert "'4' is no level of light; levels are numbered from 1 to 3" in found


# Excel -------------------------------------------------------------------------------------


def book(path, rows, title="Design"):
    openpyxl = package("openpyxl")
    made = openpyxl.Workbook()
    made.active.title = title
    for row in rows:
        made.active.append(row)
    made.save(path)
    return path


def test_excel_is_read_as_text(tmp_path):
    rows = [["task", "alternative", "gap"], [1, 1, 1.5], [None, None, None], [1, 2, 3.0]]
    table = read_table(book(tmp_path / "a.xlsx", rows))
    trials = trials_in(table, {"gap": ("1.5", "3")}, TableRequest())
    assert trials == (Trial("1", "1", (("1.5",), ("3",))),)


def test_excel_sheets_are_named(tmp_path):
    path = book(tmp_path / "a.xlsx", [["gap"], [3]], title="Final")
    assert read_table(path, sheet="Final").header == ("gap",)
    with pytest.raises(InputError, match="has no sheet 'Finall'; did you mean 'Final'"):
        read_table(path, sheet="Finall")


def test_damaged_excel_is_refused(tmp_path):
    package("openpyxl")
    with pytest.raises(InputError, match=r"is damaged, or no \.xlsx"):
        read_table(write(tmp_path, b"PK nothing", "a.xlsx"))


def test_excel_needs_its_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    with pytest.raises(MissingExtraError, match=r"\.xlsx tables need openpyxl: pip install"):
        read_table(write(tmp_path, b"PK", "a.xlsx"))
