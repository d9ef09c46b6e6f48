"""Formats of vehicle logs; everything that reads such a log goes through `FORMATS`.

A new format is a module here with a class derived from `LogFormat`, and its entry in the tuple.
"""

from __future__ import annotations

from pathlib import Path

from sumo3dviz_pt.sumo.formats.format import ElementSink, LogFormat
from sumo3dviz_pt.sumo.formats.outputs import OutputFormat
from sumo3dviz_pt.sumo.formats.table import CsvFormat, ParquetFormat
from sumo3dviz_pt.sumo.formats.xml import XmlFormat
from sumo3dviz_pt.sumo.stream import may_be_xml

FORMATS: tuple[LogFormat, ...] = (CsvFormat(), ParquetFormat(), OutputFormat(), XmlFormat())
"""All formats; the last one also reads what none recognises, so that it says what is wrong."""


def format_of(file: Path) -> LogFormat:
    """Return the format that reads a vehicle log."""
    *others, last = FORMATS
    chosen = next((each for each in others if each.recognises(file)), None)
    if chosen is None and file.suffix == ".csv" and not may_be_xml(file):
        return CsvFormat()  # says that the header is missing
    return chosen or last


def is_log(file: Path) -> bool:
    """Whether a file is a vehicle log in any format."""
    return any(each.recognises(file) for each in FORMATS)


__all__ = ["FORMATS", "ElementSink", "LogFormat", "format_of", "is_log"]
