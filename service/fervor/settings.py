"""The service's settings: read once at start from the environment and the command line, then handed down.

Rules. A setting has a name, a default and a description here, and nowhere else: the options of `fervor serve` and the
table in docs/reference/settings.md are made from this class. An option on the command line wins over the environment.
Nothing below reads the environment. What a session may use is told to every client in `session.started`.
"""

import re
import sys
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, SecretStr, ValidationError, field_validator, model_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

from fervor.errors import InputError
from fervor.protocol.codec import one_sentence
from fervor.protocol.messages import MOST_FRAMES, Limits
from fervor.protocol.skeleton_spec import MOST_JOINTS

ENV_PREFIX = "FERVOR_"
"""`max_bodies` is FERVOR_MAX_BODIES in the environment."""

MIB = 1_048_576

SHORTEST_KEY = 16
"""Characters; shorter keys can be guessed."""

_ORIGIN = re.compile(r"\*|\w[\w+.-]*://[^/?#@\s]+")

LogLevel = Literal["critical", "error", "warning", "info", "debug"]

LogFormat = Literal["text", "json"]

Switch = Literal["on", "off"]

Transport = Literal["direct", "asgi"]


class SettingsError(InputError):
    """A setting that can't be used."""

    code = "bad_settings"
    exit_code = 78


class Settings(BaseSettings):
    """Everything that can be set. Sizes are bytes, times seconds, unless the name says otherwise."""

    model_config = SettingsConfigDict(env_prefix=ENV_PREFIX, frozen=True, extra="forbid")

    host: str = Field("127.0.0.1", description="address to listen on; 0.0.0.0 for all")
    port: int = Field(8080, ge=0, le=65535, description="port to listen on; 0 takes a free one and says which")
    workers: int = Field(1, ge=1, le=256, description="processes that serve the address; each has the limits below")
    log_level: LogLevel = Field("info", description="least severity that is logged")
    log_format: LogFormat = Field(
        "text", description="`text`: lines for people; `json`: one object a line, for programs"
    )
    tokens: Annotated[tuple[SecretStr, ...], NoDecode] = Field(
        (), description="bearer tokens, separated by commas, of which a client must show one; empty: everybody may in"
    )
    tokens_file: Path | None = Field(
        None,
        description="file with more tokens, one a line, each with a name before it if wanted; read anew when changed",
    )
    origins: Annotated[tuple[str, ...], NoDecode] = Field(
        (),
        description="web origins (`https://robot.local`), separated by commas, whose pages may use the service; `*` "
        "for all; its own always may",
    )
    page: Switch = Field(
        "on",
        description="the live page at `/`, which shows the bodies of all sessions as they move: `on`, to whoever shows "
        "a token (to everybody where there is none), or `off`",
    )
    page_tokens: Annotated[tuple[SecretStr, ...], NoDecode] = Field(
        (),
        description="tokens, separated by commas, of which somebody who watches the page must show one; empty: the "
        "tokens of clients",
    )
    max_watchers: int = Field(8, ge=1, description="live pages open at once; one more is told to come later")
    model: Path | None = Field(None, description="model file (*.onnx); none: the demo model that comes with fervor")

    skeletons: Path | None = Field(None, description="folder with calibrated skeletons (*.json), known by their names")

    capacity: int = Field(1024, ge=1, le=65536, description="bodies the service follows at once, over all sessions")
    transport: Transport = Field(
        "direct",
        description="how messages get from the socket to their session: `direct`, past ASGI, or `asgi`, slower and the "
        "same to the bit",
    )
    max_connections: int = Field(
        2048, ge=1, description="connections at once, sessions included; one more is told to come later and closed"
    )
    max_header_bytes: int = Field(32_768, ge=1024, description="request line and headers of one request")
    header_timeout_s: float = Field(10.0, gt=0, description="time a connection has to bring the headers of a request")
    body_timeout_s: float = Field(60.0, gt=0, description="time a request has to bring its body")
    max_sessions: int = Field(1024, ge=1, description="WebSocket sessions at once; one more is told to come later")
    max_bodies: int = Field(16, ge=1, description="bodies in one session at once")
    max_message_bytes: int = Field(MIB, ge=1024, description="size of one WebSocket message")
    max_joints: int = Field(MOST_JOINTS, ge=1, le=MOST_JOINTS, description="joints of a session's skeleton")
    max_frames_per_message: int = Field(1024, ge=1, le=MOST_FRAMES, description="frames in one `frames` message")
    max_frames_per_second: float = Field(
        2000.0, gt=0, description="frames a second from one session, over all bodies; any other message counts as one"
    )
    max_unsent_bytes: int = Field(
        4 * MIB, ge=1024, description="answers that may wait for a slow reader before its session is closed"
    )
    max_unanswered_frames: int = Field(
        4096, ge=1, description="frames of one session under way, above which the service reads no further for a while"
    )
    max_queue: int = Field(
        65_536,
        ge=1,
        description="frames of all sessions under way, above which the service reads no further for a while",
    )
    max_queue_delay_s: float = Field(
        0.5,
        gt=0,
        description="wait for the model, kept up for a second, above which sessions are refused and sent away",
    )
    start_timeout_s: float = Field(10.0, gt=0, description="time a new connection has to send `session.start`")
    idle_timeout_s: float = Field(60.0, gt=0, description="silence after which a session is closed")
    body_idle_s: float = Field(10.0, gt=0, description="client time without a frame after which a body is forgotten")

    score_max_bytes: int = Field(16 * MIB, ge=1024, description="size of a request to /v1/score and /v1/score/file")
    score_max_frames: int = Field(100_000, ge=1, description="frames in one scoring request, over all sequences")
    score_max_sequences: int = Field(256, ge=1, description="sequences in one scoring request")
    score_queue: int = Field(8, ge=1, description="scoring requests under way; one more is told to come later")
    score_timeout_s: float = Field(120.0, gt=0, description="time one scoring request may take before it is given up")

    checkpoint_keys: Annotated[tuple[SecretStr, ...], NoDecode] = Field(
        (),
        description="keys that sign checkpoints, separated by commas, 16 characters or more each: the first signs, all "
        "are believed; the same on all replicas. Empty: one is made up, and no stream survives a restart",
    )
    checkpoint_keys_file: Path | None = Field(
        None, description="file with the keys, one a line, in place of FERVOR_CHECKPOINT_KEYS; read anew when changed"
    )
    checkpoint_ttl_s: float = Field(300.0, gt=0, description="age above which a checkpoint is not taken back")

    drain_s: float = Field(5.0, ge=0, description="time that streams have to take their last checkpoints at the end")
    shutdown_grace_s: int = Field(10, ge=0, description="time that open connections have to end when the service stops")

    @field_validator("tokens", "page_tokens", "origins", "checkpoint_keys", mode="before")
    @classmethod
    def _split(cls, value: Any) -> Any:
        if isinstance(value, str):
            return tuple(part.strip() for part in value.split(",") if part.strip())
        return value

    @field_validator("origins")
    @classmethod
    def _whole_origins(cls, origins: tuple[str, ...]) -> tuple[str, ...]:
        for origin in origins:
            if not _ORIGIN.fullmatch(origin):
                raise ValueError(f"{origin!r} is no web origin; expected scheme://host or scheme://host:port, or *")
        return tuple(origin.lower() for origin in origins)

    @model_validator(mode="after")
    def _one_home_of_keys(self) -> Self:
        if self.checkpoint_keys and self.checkpoint_keys_file:
            raise ValueError("checkpoint_keys and checkpoint_keys_file are both given; expected one of them")
        return self

    @field_validator("checkpoint_keys")
    @classmethod
    def _long_enough(cls, keys: tuple[SecretStr, ...]) -> tuple[SecretStr, ...]:
        if any(len(key.get_secret_value()) < SHORTEST_KEY for key in keys):
            raise ValueError(f"a key has fewer than {SHORTEST_KEY} characters; expected a long random one")
        return keys

    @classmethod
    def load(cls, **options: Any) -> Self:
        """The settings from `options` (those that are not None), then the environment, then the defaults.

        Raises:
            SettingsError: one that can't be used; says which, what was expected and what came.
        """
        try:
            return cls(**{name: value for name, value in options.items() if value is not None})
        except ValidationError as error:
            first = error.errors(include_input=False)[0]
            name = str(first["loc"][0]) if first["loc"] else ""
            if name in cls.model_fields and not is_option(name):  # a secret must not be told back
                raise SettingsError(f"setting {name}: {first['msg'].removeprefix('Value error, ')}") from None
            raise SettingsError(f"setting {one_sentence(error)}") from None

    @property
    def limits(self) -> Limits:
        """What one session may use, as told in `session.started`."""
        return Limits(**{name: getattr(self, name) for name in Limits.model_fields})


def reference() -> str:
    """All settings as a Markdown table, for docs/reference/settings.md."""
    rows = ["| environment | option | default | what it is |", "|---|---|---|---|"]
    for name, field in Settings.model_fields.items():
        option = f"`{option_name(name)}`" if is_option(name) else "-"
        rows.append(f"| `{ENV_PREFIX}{name.upper()}` | {option} | {_shown(field.default)} | {field.description} |")
    return "\n".join(rows) + "\n"


def option_name(name: str) -> str:
    """The option of `fervor serve` that sets `name`."""
    return "--" + name.replace("_", "-")


def is_option(name: str) -> bool:
    """Whether `name` can be set on the command line; secrets can't, for everybody on a machine sees command lines."""
    return "SecretStr" not in str(Settings.model_fields[name].annotation)


def _shown(default: Any) -> str:
    return f"`{default}`" if default not in (None, ()) else "-"


if __name__ == "__main__":
    sys.stdout.write(reference())
