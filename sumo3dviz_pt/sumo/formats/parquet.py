"""SUMO's vehicle log as a Parquet table; reading it needs the package pyarrow."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from sumo3dviz_pt.errors import InputError, MissingExtraError
from sumo3dviz_pt.files.whole import open_plain
from sumo3dviz_pt.sumo.formats.format import ATTRIBUTES, Cells
from sumo3dviz_pt.sumo.formats.table import Block, Header, TableFormat, header_of
from sumo3dviz_pt.sumo.stream import TruncatedError

_MAGIC = b"PAR1"
_TAIL = 8  # bytes: the length of the footer and the magic number again
_BATCH = 65_536
_NAMES = (b"time", b"id", b"x", b"y")
_NUMBERS: dict[str, float] = {
    "z": 0.0,
    "slope": 0.0,
    "signals": -1,
    **dict.fromkeys(("x", "y", "angle", "speed", "pos"), float("nan")),
}
"""What stands for a number that a row does not have."""


class ParquetFormat(TableFormat):
    """A table by columns, as SUMO writes it for names that end in `.parquet`."""

    def recognises(self, file: Path) -> bool:
        """Whether a file is Parquet with the columns of a log, judging without pyarrow."""
        try:
            footer = _footer(file)
        except (OSError, InputError):
            return False
        if footer is None:
            return False
        return not footer or b"timestep_time" in footer or all(name in footer for name in _NAMES)

    def header(self, file: Path) -> Header:
        """Return the columns of a file that is recognised."""
        return header_of(_opened(file).schema_arrow.names)

    def has_lanes(self, file: Path) -> bool:
        """Whether any row names a lane."""
        parquet = _opened(file)
        places = [n for n, name in enumerate(self.header(file).names) if name == "lane"]
        groups = range(parquet.metadata.num_row_groups)
        for column in (parquet.metadata.row_group(g).column(n) for g in groups for n in places):
            known = column.statistics
            if known is None or not known.has_null_count or known.null_count < column.num_values:
                return True
        return False

    def blocks(self, file: Path) -> Iterator[Block]:
        """Yield the rows of the table in order."""
        parquet = _opened(file)
        names = self.header(file).names
        if not self.header(file).is_log:
            raise InputError(
                "is a Parquet file without the columns of a vehicle log (time, id, x, y);"
                " name the right file",
                file=file,
            )
        wanted = [
            own
            for own, name in zip(parquet.schema_arrow.names, names, strict=True)
            if name in ATTRIBUTES or name in ("time", "tag")
        ]
        line = 1
        arrow: Any = _arrow()
        _check_types(parquet.schema_arrow, wanted, file)
        try:
            for batch in parquet.iter_batches(_BATCH, columns=wanted):
                own = header_of(batch.schema.names).names
                columns = {
                    name: _cells(name, column)
                    for name, column in zip(own, batch.columns, strict=True)
                }
                yield Block(columns, line)
                line += batch.num_rows
        except (OSError, arrow.ArrowException) as error:
            raise InputError(
                f"cannot be read ({error}); write it again", file=file, line=line
            ) from error


def _check_types(schema: Any, wanted: list[str], file: Path) -> None:
    """Refuse columns of lists and other things within things."""
    for name in wanted:
        kind = schema.field(name).type
        if _arrow().types.is_nested(kind):
            message = f"the column {name} holds {kind}, and should hold numbers or text"
            raise InputError(message, file=file)


def _cells(name: str, column: Any) -> Cells:
    """Return a column as a list without nulls."""
    missing = _NUMBERS.get(name)
    if name == "time":
        cells: Cells = column.to_numpy(zero_copy_only=False).tolist()
        return cells
    if missing is not None:
        if column.null_count == len(column):
            return [missing] * len(column)
        filled = column.fill_null(missing) if column.null_count else column
        numbers: list[float] = filled.to_numpy(zero_copy_only=False).tolist()
        return numbers
    # Few texts repeat many times; each is made once.
    coded = column.cast("string").fill_null("").dictionary_encode()
    texts: list[str] = coded.dictionary.to_pylist()
    return [texts[code] for code in coded.indices.to_numpy().tolist()]


def _footer(file: Path) -> bytes | None:
    """Return the description of a Parquet file, empty if it is broken; None for other files."""
    with open_plain(file) as stream:
        if stream.read(len(_MAGIC)) != _MAGIC:
            return None
        size = stream.seek(0, 2)
        if size < 2 * len(_MAGIC) + _TAIL:
            return b""
        stream.seek(size - _TAIL)
        tail = stream.read(_TAIL)
        length = int.from_bytes(tail[:4], "little")
        if tail[4:] != _MAGIC or length + _TAIL > size:
            return b""
        stream.seek(size - _TAIL - length)
        return stream.read(length)


def _arrow() -> ModuleType:
    """Return pyarrow.

    Raises:
        MissingExtraError: If it is not installed.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise MissingExtraError("vehicle logs in Parquet need pyarrow", extra="parquet") from error
    module: ModuleType = pyarrow
    return module


def _opened(file: Path) -> Any:
    """Return a Parquet file, open."""
    arrow: Any = _arrow()
    if not _footer(file):
        raise TruncatedError("the file ends in the middle; copy or write it again", file=file)
    try:
        return arrow.parquet.ParquetFile(file)
    except (OSError, arrow.ArrowException) as error:
        raise InputError(f"cannot be read ({error}); write it again", file=file) from error
