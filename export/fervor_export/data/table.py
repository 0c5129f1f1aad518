"""CSV tables as data sets bring them: commas, semicolons or tabs; UTF-8, UTF-16 or what Windows writes."""

import codecs
import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from fervor.errors import DataError


@dataclass(frozen=True, slots=True)
class Row:
    """One row that is not empty."""

    line: int
    """In the file, from 1; of a cell with line ends, the last."""
    cells: Mapping[str, str]
    """By column; empty where the row is too short."""
    width: int
    """How many cells the row has."""

    def __getitem__(self, column: str) -> str:
        return self.cells.get(column, "")


@dataclass(frozen=True, slots=True)
class Table:
    """Columns, in lower case with _ for blanks, and rows."""

    columns: tuple[str, ...]
    rows: tuple[Row, ...]

    def missing(self, *columns: str) -> list[str]:
        """Those of `columns` that the table has not."""
        return [column for column in columns if column not in self.columns]


def read_table(path: Path) -> Table:
    """The table in a CSV file.

    Raises:
        DataError: the file can't be read as one.
    """
    text = read_text(path)
    first = text.partition("\n")[0]
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=first.count))
    try:
        columns = tuple("_".join(name.lower().split()) for name in next(reader, []))
        rows = [
            Row(reader.line_num, dict(zip(columns, (cell.strip() for cell in cells), strict=False)), len(cells))
            for cells in reader
            if any(cell.strip() for cell in cells)
        ]
    except csv.Error as error:
        raise DataError(f"{path}, line {reader.line_num}: not a table ({error})") from None
    return Table(columns, tuple(rows))


def read_text(path: Path) -> str:
    """A text file whose encoding nobody says: by its byte order mark, else UTF-8, else Windows-1252.

    Raises:
        DataError: the file can't be read.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path}: can't be read: {error.strerror or error}") from error
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")
