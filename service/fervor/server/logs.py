"""What the service writes to its log: lines for people, or one JSON object a line for programs.

uvicorn's own lines take the same form. No line shows a token or a key: queries of requests are left out, because some
clients put tokens there by mistake.
"""

import json
import logging
from datetime import UTC, datetime
from typing import Any

from fervor.settings import LogFormat, LogLevel

TEXT = "%(asctime)s %(levelname)s %(name)s: %(message)s"

FIELDS = ("session", "client", "body", "reason", "totals")
"""What a line may say beside its message: `extra` of the logging calls."""

QUERY_LOGGERS = ("uvicorn.access", "uvicorn.error")
"""Loggers of uvicorn that name requests."""


class TextFormatter(logging.Formatter):
    """A line for people, with the session it is about."""

    def __init__(self) -> None:
        super().__init__(TEXT)

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802  # the name that logging gives it
        """The line, without a trace."""
        about = "".join(f" {name}={value}" for name in FIELDS[:2] if (value := getattr(record, name, None)))
        return super().formatMessage(record).replace("\n", "\\n") + about


class JsonFormatter(logging.Formatter):
    """A JSON object: time (UTC), level, logger, message, what of `FIELDS` there is, and an `exception`."""

    def format(self, record: logging.LogRecord) -> str:
        """The object, on one line."""
        line: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        line |= {name: value for name in FIELDS if (value := getattr(record, name, None)) is not None}
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, default=str)


def configure_logs(log_format: LogFormat, level: LogLevel) -> None:
    """Write logs to standard error in this form, from this level on."""
    handler = logging.StreamHandler()
    handler.setFormatter(JsonFormatter() if log_format == "json" else TextFormatter())
    logging.basicConfig(level=level.upper(), handlers=[handler])
    for name in QUERY_LOGGERS:
        logging.getLogger(name).addFilter(leave_out_query)
    logging.getLogger("uvicorn.error").addFilter(shorten_bad_text)


def leave_out_query(record: logging.LogRecord) -> bool:
    """Cut the query off every address in a line of uvicorn's."""
    if isinstance(record.args, tuple):
        record.args = tuple(arg.partition("?")[0] if isinstance(arg, str) else arg for arg in record.args)
    return True


def shorten_bad_text(record: logging.LogRecord) -> bool:
    """Make one line of a client's text that is not UTF-8: uvicorn logs it as an error of its own, with a trace."""
    if record.exc_info and isinstance(record.exc_info[1], UnicodeDecodeError) and "Invalid UTF-8" in record.msg:
        record.exc_info, record.levelno, record.levelname = None, logging.WARNING, "WARNING"
    return True
