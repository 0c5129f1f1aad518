"""The AsyncAPI 3 document of `/v1/stream`, made from the message models: clients in any language start from it."""

from typing import Any

from pydantic import BaseModel, TypeAdapter

from fervor.errors import (
    CheckpointMismatch,
    CheckpointUnknown,
    CloseCode,
    EngineError,
    FervorError,
    FrameError,
    IdleTimeout,
    InputError,
    MessageError,
    Overloaded,
    ProtocolError,
    RateExceeded,
    StartTimeout,
)
from fervor.protocol.codec import CODECS
from fervor.protocol.examples import EXAMPLES
from fervor.protocol.messages import PROTOCOL, ClientMessage, ServerMessage

_REF = "#/components/schemas/{model}"

CLOSES = {
    CloseCode.NORMAL: "the session ended",
    CloseCode.GOING_AWAY: "the peer goes away",
    CloseCode.TOO_LARGE: "a message had more bytes than the service takes",
    CloseCode.INTERNAL: "a fault of the service",
    CloseCode.RESTART: "the service restarts: connect again and resume",
    CloseCode.OVERLOADED: "no room, or answers were read too slowly: connect again later",
    CloseCode.BAD_MESSAGE: "the conversation can't go on after a message; an error said why",
    CloseCode.AUTH: "no token or a wrong one",
    CloseCode.CHECKPOINT_UNKNOWN: "a checkpoint that was not signed by this service, or is too old: start anew",
    CloseCode.TIMEOUT: "no session.start in time, or nothing came for too long",
    CloseCode.CHECKPOINT_MISMATCH: "a checkpoint of another model or of other terms: start anew",
    CloseCode.RATE: "more frames a second than the service takes",
}
"""What each close code means."""


FROM_WEBSOCKET = {
    1002: "what came is no WebSocket",
    1007: "a text message that is not UTF-8",
}
"""Closes that come from the layer below, without an error before."""

_ERRORS: tuple[type[FervorError], ...] = (
    MessageError,
    FrameError,
    InputError,
    Overloaded,
    EngineError,
    ProtocolError,
    StartTimeout,
    IdleTimeout,
    RateExceeded,
    CheckpointUnknown,
    CheckpointMismatch,
    FervorError,
)
"""What an `error` message may tell; those without a close code end nothing."""


def asyncapi(version: str) -> dict[str, Any]:
    """The document, for a service of this version."""
    schemas: dict[str, Any] = {}
    said, heard = (_messages(union, schemas) for union in (ClientMessage, ServerMessage))
    return {
        "asyncapi": "3.0.0",
        "info": {
            "title": "fervor: live stream",
            "version": version,
            "description": _DESCRIPTION,
            "license": {"name": "Apache-2.0"},
        },
        "defaultContentType": "application/json",
        "servers": {
            "local": {
                "host": "127.0.0.1:8080",
                "protocol": "ws",
                "description": "where a service listens unless told otherwise; behind TLS it is wss",
                "security": [{"$ref": f"#/components/securitySchemes/{name}"} for name in _SECURITY],
            }
        },
        "channels": {
            "stream": {
                "address": "/v1/stream",
                "title": "One WebSocket conversation",
                "messages": {name: {"$ref": f"#/components/messages/{name}"} for name in (*said, *heard)},
                "bindings": {"ws": {"method": "GET", "headers": _headers(), "bindingVersion": "0.1.0"}},
            }
        },
        "operations": {
            "send": _operation("receive", said, "What a client may send; session.start first."),
            "answer": _operation("send", heard, "What the service says; every frame is answered by one estimate."),
        },
        "components": {
            "messages": {**said, **heard},
            "schemas": {name: _with_plain_tuples(schema) for name, schema in schemas.items()},
            "securitySchemes": _SECURITY,
        },
        "x-subprotocols": {
            f"{PROTOCOL}.json": "one JSON object a text message",
            f"{PROTOCOL}.msgpack": "one MessagePack map a binary message; the schema Raw stands for its bin type",
        },
        "x-error-codes": [
            {
                "code": kind.code,
                "closes": None if kind.close_code is None else int(kind.close_code),
                "meaning": (kind.__doc__ or "").splitlines()[0],
            }
            for kind in _ERRORS
        ],
        "x-close-codes": {str(int(code)): meaning for code, meaning in sorted((CLOSES | FROM_WEBSOCKET).items())},
    }


_DESCRIPTION = f"""Poses in, intensities out. Subprotocols: {", ".join(f"`{name}`" for name in CODECS)}:
the same messages as JSON text or as MessagePack maps; in MessagePack the joints `q` and `p` of a frame may be raw
little-endian float32. permessage-deflate is not used. Refusals before the upgrade are HTTP problems: 400, 401, 503.

`session.start` comes first, and once; `ping` may come before it. Each frame is answered by one `estimate`, or by one
`error` that names its `body` and `seq`; a `frames` message by one `estimates`. Fields that are not in the schemas are
refused in what a client sends, and to be passed over in what the service says. Recoverable errors keep the connection;
a fatal one precedes its close.

To go on after a lost connection: ask for `checkpoint`s with `checkpoint_s`, keep the newest token of each body and what
was sent after its frame `seq`, connect again, send the same `session.start` with the tokens in `resume`, and send
again, in order, what was kept. Answers that came before come again, unchanged."""

_SECURITY: dict[str, Any] = {
    "bearer": {"type": "http", "scheme": "bearer", "description": "where the service has tokens"},
    "browser": {
        "type": "httpApiKey",
        "in": "header",
        "name": "Sec-WebSocket-Protocol",
        "description": "or one more entry `fervor.token.TOKEN` beside the subprotocol, as browsers can't set headers",
    },
}


def _messages(union: Any, schemas: dict[str, Any]) -> dict[str, Any]:
    """The message objects of a union, by type; their schemas are added to `schemas`."""
    messages = {}
    for model in union.__origin__.__args__:
        assert issubclass(model, BaseModel)
        schema = TypeAdapter(model).json_schema(ref_template=_REF)
        schemas.update(schema.pop("$defs", {}))
        schemas[model.__name__] = schema
        example = EXAMPLES[model]
        messages[model.__name__] = {
            "name": model.model_fields["type"].default,
            "title": model.__name__,
            "summary": (model.__doc__ or "").strip().splitlines()[0],
            "payload": {"allOf": [{"$ref": _REF.format(model=model.__name__)}, {"required": ["type"]}]},
            "examples": [{"payload": example.model_dump(mode="json", exclude_none=True)}],
        }
    return messages


def _with_plain_tuples(schema: Any) -> Any:
    """The schema in the dialect of AsyncAPI (JSON Schema draft 7), which knows no `prefixItems`."""
    if isinstance(schema, list):
        return [_with_plain_tuples(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    plain = {key: _with_plain_tuples(value) for key, value in schema.items()}
    prefix = plain.pop("prefixItems", None) if isinstance(plain.get("prefixItems"), list) else None
    if prefix:
        assert all(item == prefix[0] for item in prefix), "a tuple of different things needs another form"
        plain["items"] = prefix[0]
    return plain


def _operation(action: str, messages: dict[str, Any], summary: str) -> dict[str, Any]:
    return {
        "action": action,
        "channel": {"$ref": "#/channels/stream"},
        "summary": summary,
        "messages": [{"$ref": f"#/channels/stream/messages/{name}"} for name in messages],
    }


def _headers() -> dict[str, Any]:
    return {
        "type": "object",
        "properties": {
            "Sec-WebSocket-Protocol": {
                "type": "string",
                "examples": [*CODECS, f"{PROTOCOL}.json, fervor.token.TOKEN"],
                "description": f"the encoding of {PROTOCOL}; of several that the service knows it takes the first",
            },
            "Authorization": {"type": "string", "description": "Bearer TOKEN, where the service asks for one"},
        },
    }
