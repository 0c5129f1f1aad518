"""The AsyncAPI 3 document of `/v1/stream`, made from the message models: clients in any language start from it."""

from typing import Any

from pydantic import BaseModel, TypeAdapter

from fervor.errors import CloseCode
from fervor.protocol.codec import CODECS
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
        "components": {"messages": {**said, **heard}, "schemas": schemas},
        "x-close-codes": {str(int(code)): meaning for code, meaning in CLOSES.items()},
    }


_DESCRIPTION = f"""Poses in, intensities out. Subprotocols: {", ".join(f"`{name}`" for name in CODECS)}:
the same messages as JSON text or as MessagePack maps; in MessagePack the joints `q` and `p` of a frame may be raw
little-endian float32. A token goes into `Authorization: Bearer` or, in browsers, into a subprotocol entry
`fervor.token.TOKEN`. Recoverable errors keep the connection; a fatal one precedes its close."""


def _messages(union: Any, schemas: dict[str, Any]) -> dict[str, Any]:
    """The message objects of a union, by type; their schemas are added to `schemas`."""
    messages = {}
    for model in union.__origin__.__args__:
        assert issubclass(model, BaseModel)
        schema = TypeAdapter(model).json_schema(ref_template=_REF)
        schemas.update(schema.pop("$defs", {}))
        schemas[model.__name__] = schema
        messages[model.__name__] = {
            "name": model.model_fields["type"].default,
            "title": model.__name__,
            "summary": (model.__doc__ or "").strip().splitlines()[0],
            "payload": {"$ref": _REF.format(model=model.__name__)},
        }
    return messages


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
                "enum": list(CODECS),
                "description": f"encoding of {PROTOCOL}",
            },
            "Authorization": {"type": "string", "description": "Bearer TOKEN, where the service asks for one"},
        },
    }
