"""Where a recording comes from: a path or an open stream, its bytes or text, and what to call it."""

from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import IO, Any

from fervor.errors import RecordingError


@dataclass(frozen=True, slots=True)
class Content:
    """The content of a source."""

    data: bytes
    label: str  # for messages: the file's name
    name: str  # of the recording

    @property
    def text(self) -> str:
        """The content as text.

        Raises:
            RecordingError: it is binary.
        """
        if b"\0" in self.data[:4096]:
            raise RecordingError(f"{self.label}: the file is binary; expected text")
        return self.data.decode("utf-8-sig", errors="replace")


def read_content(source: Path | str | IO[Any], name: str | None = None) -> Content:
    """Reads a path, or an open text or binary stream, to its end.

    Args:
        source: a str is a path.
        name: of the recording; by default the file's name without suffix.

    Raises:
        RecordingError: the file can't be opened or read.
    """
    try:
        if isinstance(source, str | Path):
            label, data = str(source), Path(source).read_bytes()
        else:
            label, data = _stream_label(source), _bytes(source.read())
    except OSError as error:
        raise RecordingError(f"{source}: can't be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise RecordingError(f"{name or 'stream'}: the file is binary; expected text") from error
    return Content(data, label or name or "stream", name or PurePath(label).stem or "recording")


def _stream_label(stream: object) -> str:
    """A stream's file name; empty where it has none."""
    label = getattr(stream, "name", "")
    return label if isinstance(label, str) else ""


def _bytes(read: str | bytes) -> bytes:
    """What a text or binary stream gave, as bytes."""
    return read.encode() if isinstance(read, str) else read
