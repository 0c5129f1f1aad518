"""What the scoring process does: a request body in, a response body out.

Decoding and encoding belong to the work, so that not even a large body holds up the service's loop.
"""

import io
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from pydantic import ValidationError
from python_multipart import parse_form
from python_multipart.exceptions import FormParserError
from python_multipart.multipart import Field, File

from fervor.errors import RequestError, TooLarge
from fervor.model import Model
from fervor.protocol.codec import one_sentence
from fervor.protocol.messages import SessionStart
from fervor.recordings.reader import read_recording
from fervor.recordings.recording import Recording
from fervor.recordings.table_jsonl import jsonl_of
from fervor.scoring.scorer import Scorer
from fervor.server.model_info import model_info
from fervor.server.recordings import score_recordings
from fervor.server.scoring_models import (
    MULTIPART,
    FileOptions,
    ScoreResponse,
    SequenceScore,
)
from fervor.server.scoring_process import Allowed
from fervor.server.scoring_progress import Meter, Told
from fervor.server.scoring_requests import read_request, take_of
from fervor.session.start import agree
from fervor.skeletons.skeleton import Skeleton


@dataclass(frozen=True, slots=True)
class Upload:
    """One uploaded recording."""

    filename: str
    content: bytes


class ScoringJobs:
    """The kinds of request about whole recordings."""

    def __init__(
        self, model: Model, allowed: Allowed, skeletons: Mapping[str, Skeleton], *, row_multiple: int = 1
    ) -> None:
        """Prepare.

        Args:
            model: what to run.
            allowed: limits of a request.
            skeletons: those beside the catalogue's, by name.
            row_multiple: see `fervor.engine.Engine`.
        """
        self._model = model
        self._allowed = allowed
        self._skeletons = skeletons
        self._scorer = Scorer(model, row_multiple=row_multiple)

    def score(self, body: bytes, content_type: str, *, tell: Told | None = None) -> bytes:
        """Score the sequences of a request in JSON or MessagePack; `tell` is told of progress.

        Raises:
            InputError: something in the request can't be used; says where.
            TooLarge: more frames or sequences than allowed.
        """
        asked = read_request(body, content_type)
        self._check(len(asked.sequences), asked.frames)
        terms_asked = SessionStart(**asked.terms.model_dump(exclude={"sequences", "detail"}))
        agreement = agree(terms_asked, self._model.metadata, self._skeletons)
        takes = [take_of(number, sequence, agreement) for number, sequence in enumerate(asked.sequences)]
        terms = replace(agreement.terms, emotion_ttl_s=math.inf)
        scored = self._scorer.score(takes, terms, progress=Meter(asked.frames, tell).add)
        return self._answer(SequenceScore.of(each, asked.terms.detail) for each in scored)

    def score_files(
        self, body: bytes, content_type: str, query: Mapping[str, object], *, tell: Told | None = None
    ) -> bytes:
        """Score uploaded recordings: a form with files, or a body that is a file; `tell` is told of progress.

        Raises:
            InputError: an option or a file can't be used; says which.
            TooLarge: more frames or files than allowed.
        """
        fields, uploads = self._read_form(body, content_type) if content_type.startswith(MULTIPART) else ({}, [])
        try:
            options = FileOptions.model_validate({**query, **fields})
        except ValidationError as error:
            raise RequestError(one_sentence(error)) from None
        if not content_type.startswith(MULTIPART):
            uploads = [Upload(options.filename or "", body)]
        if not uploads:
            raise RequestError("the form has no file; expected one or more recordings")
        self._check(len(uploads), 0)
        recordings = [_read_recording(upload, options.skeleton) for upload in uploads]
        frames = sum(map(len, recordings))
        self._check(len(uploads), frames)
        progress = Meter(frames, tell).add
        metadata = self._model.metadata
        return self._answer(score_recordings(self._scorer, metadata, recordings, options, progress=progress))

    def convert_file(self, body: bytes, filename: str, skeleton: str | None) -> bytes:
        """A recording on the rig, as JSON lines.

        Raises:
            InputError: the file can't be used; says why.
            TooLarge: more frames than allowed.
        """
        recording = _read_recording(Upload(filename, body), skeleton)
        self._check(1, len(recording))
        return jsonl_of(recording).encode()

    def _read_form(self, body: bytes, content_type: str) -> tuple[dict[str, str], list[Upload]]:
        """The fields of a form, and its files; no more of both than could be of use."""
        fields: dict[str, str] = {}
        uploads: list[Upload] = []

        def keep_field(field: Field) -> None:
            fields[_text(field.field_name)] = _text(field.value)
            if len(fields) > len(FileOptions.model_fields):
                raise TooLarge(f"the form has more than {len(FileOptions.model_fields)} fields beside its files")

        def keep_file(file: File) -> None:
            file.file_object.seek(0)
            uploads.append(Upload(_text(file.file_name), file.file_object.read()))
            file.close()
            self._check(len(uploads), 0)

        try:
            parse_form({"Content-Type": content_type.encode()}, io.BytesIO(body), keep_field, keep_file)
        except FormParserError as error:
            raise RequestError(f"the form can't be read: {error}") from None
        return fields, uploads

    def _answer(self, scores: Iterable[SequenceScore]) -> bytes:
        model = self._model
        response = ScoreResponse(model=model_info(model), fingerprint=model.fingerprint, sequences=tuple(scores))
        return response.model_dump_json().encode()

    def _check(self, sequences: int, frames: int) -> None:
        for count, most, what in (
            (sequences, self._allowed.sequences, "sequences"),
            (frames, self._allowed.frames, "frames"),
        ):
            if count > most:
                raise TooLarge(f"the request has {count} {what}; this service takes at most {most} in one request")


def _read_recording(upload: Upload, skeleton: str | None) -> Recording:
    stream = io.BytesIO(upload.content)
    stream.name = upload.filename  # what readers call the file in their messages, and tell its kind by
    return read_recording(stream, skeleton=skeleton)


def _text(raw: bytes | None) -> str:
    return (raw or b"").decode("utf-8", errors="replace")
