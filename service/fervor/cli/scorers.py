"""The two ways to score a file: here, or by a running service."""

import json
from pathlib import Path
from urllib.error import HTTPError, URLError
from urllib.parse import urlencode, urlsplit
from urllib.request import Request, urlopen

from pydantic import ValidationError

from fervor.cli.picture.rule import hysteresis_at
from fervor.cli.recordings import find_skeleton, read
from fervor.errors import AuthError, FervorError, InputError, Overloaded, RequestError, Unreachable
from fervor.model import Model, check_row_independence, default_model_path
from fervor.protocol.messages import ModelInfo
from fervor.recordings.source import read_content
from fervor.scoring.scorer import Scorer
from fervor.server.model_info import model_info
from fervor.server.recordings import score_recordings
from fervor.server.scoring_models import FileOptions, ScoreResponse, SequenceScore

PATIENCE_S = 600.0
"""How long a service may take over one file, seconds."""


class Here:
    """Scores in this process."""

    def __init__(self, model: Path | None, options: FileOptions) -> None:
        loaded = Model.load(model or default_model_path())
        self.model: ModelInfo = model_info(loaded)
        self.fingerprint = loaded.fingerprint
        self._metadata = loaded.metadata
        self.hysteresis: float | None = loaded.metadata.levels.hysteresis
        self._scorer = Scorer(loaded, row_multiple=check_row_independence(loaded))
        self._options = options

    def score(self, file: Path) -> SequenceScore:
        """The score of one file, named as it was given.

        Raises:
            InputError: the file or the emotion can't be used.
        """
        recording = read(file, skeleton=self._options.skeleton)
        (scored,) = score_recordings(self._scorer, self._metadata, [recording], self._options)
        return scored.model_copy(update={"name": str(file)})


class Remote:
    """Has a running service score."""

    def __init__(self, url: str, options: FileOptions, token: str | None) -> None:
        parts = urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.netloc:
            raise InputError(f"{url!r} is not the address of a service; expected one like http://127.0.0.1:8080")
        if not isinstance(find_skeleton(options.skeleton), str | None):
            raise InputError(
                f"a service takes no file {options.skeleton!r}; expected the name of a skeleton it keeps (--skeletons)"
            )
        self._base = f"{parts.scheme}://{parts.netloc}{parts.path.rstrip('/')}"
        self._url = f"{self._base}/v1/score/file"
        self._options = options
        self._token = token
        self._answer: ScoreResponse | None = None

    @property
    def model(self) -> ModelInfo:
        """The model that answered last."""
        assert self._answer is not None
        return self._answer.model

    @property
    def fingerprint(self) -> str:
        """Its fingerprint."""
        assert self._answer is not None
        return self._answer.fingerprint

    @property
    def hysteresis(self) -> float | None:
        """Half-width of the band in which its levels stay; None where the service does not tell."""
        return hysteresis_at(self._base, self._token)

    def score(self, file: Path) -> SequenceScore:
        """The score of one file, named as it was given.

        Raises:
            InputError: the file or the emotion can't be used.
            FervorError: the service can't be reached, is full, or wants a token.
        """
        content = read_content(file)
        options = self._options.model_dump(exclude_none=True, exclude_defaults=True) | {"filename": file.name}
        request = Request(f"{self._url}?{urlencode(options)}", data=content.data, method="POST")  # noqa: S310  # http(s)
        request.add_header("Content-Type", "application/octet-stream")
        if self._token:
            request.add_header("Authorization", f"Bearer {self._token}")
        self._answer = self._send(request)
        return self._answer.sequences[0].model_copy(update={"name": str(file)})

    def _send(self, request: Request) -> ScoreResponse:
        try:
            with urlopen(request, timeout=PATIENCE_S) as response:  # noqa: S310  # http(s), checked above
                return ScoreResponse.model_validate_json(response.read())
        except HTTPError as error:
            raise _refused(error.code, error.read(), self._url) from None
        except (URLError, TimeoutError, ConnectionError) as error:
            cause = error.reason if isinstance(error, URLError) else error
            raise Unreachable(f"no service answers at {self._url}: {cause}") from None
        except ValidationError:
            raise Unreachable(f"what answers at {self._url} is not a fervor service") from None


def _refused(status: int, body: bytes, url: str) -> FervorError:
    """The error that a problem document (RFC 9457) tells."""
    try:
        sentence = str(json.loads(body)["detail"])
    except (ValueError, KeyError, TypeError):
        return Unreachable(f"what answers at {url} is not a fervor service: HTTP {status}")
    kinds: dict[int, type[FervorError]] = {401: AuthError, 413: RequestError, 422: RequestError, 503: Overloaded}
    return kinds.get(status, FervorError)(sentence)
