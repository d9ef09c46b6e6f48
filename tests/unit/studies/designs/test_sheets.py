"""Sheets of Excel as programs leave them: with a stale size, damaged, packed too tightly."""

import io
import zipfile

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.studies.designs.cells import read_table
from sumo3dviz_pt.studies.designs.trials import build_playlists, single_trials

openpyxl = pytest.importorskip("openpyxl")


@pytest.fixture
def sheet(tmp_path):
    book = openpyxl.Workbook()
    for row in [("task", "light"), *((number, "day") for number in range(1, 9))]:
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    return tmp_path / "a.xlsx"


def repacked(path, change):
    """Write a sheet again with changed XML."""
    with zipfile.ZipFile(path) as old:
        parts = {name: old.read(name) for name in old.namelist()}
    parts = {name: change(data) if "sheet1" in name else data for name, data in parts.items()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for name, data in parts.items():
            new.writestr(name, data)


def test_rows_beyond_the_stated_size_are_read(sheet):
    repacked(sheet, lambda text: text.replace(b'ref="A1:B9"', b'ref="A1:B3"'))
    assert len(read_table(sheet).rows) == 8


def test_damaged_sheets_are_read_or_refused(sheet):
    whole, chance = sheet.read_bytes(), np.random.default_rng(5)
    outcomes = set()
    for _ in range(150):
        data = bytearray(whole)
        for place in chance.integers(len(data), size=4):
            data[place] = int(chance.integers(256))
        sheet.write_bytes(bytes(data))
        try:
            read_table(sheet)
            outcomes.add("read")
        except InputError as error:
            assert "\n" not in str(error)
            outcomes.add("refused")
    assert "refused" in outcomes


def test_a_sheet_that_unpacks_to_more_than_any_is_refused(sheet):
    text = io.BytesIO()
    with zipfile.ZipFile(text, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("xl/a.xml", bytes(250_000_000))
    sheet.write_bytes(text.getvalue())
    with pytest.raises(InputError, match="unpacks to 250,000,000 bytes"):
        read_table(sheet)


def test_too_many_rows_are_refused(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("task\n" + "1\n" * 20_001, encoding="utf-8")
    with pytest.raises(InputError, match="20,000 rows"):
        read_table(path)


@pytest.mark.parametrize(("order", "count"), [("latin", None), ("latin", 3), ("random", 10_000)])
def test_twenty_thousand_trials_are_not_squared(order, count):
    trials = single_trials([(str(number),) for number in range(20_000)])
    with pytest.raises(ConfigError, match=r"^playlists\.(order|count)"):
        build_playlists(trials, order=order, count=count, parts=1, repeat=1, seed=0)
