"""The AsyncAPI document says what the models say, and every reference in it resolves."""

import json

import jsonschema
import pytest

from fervor.errors import CloseCode
from fervor.protocol.asyncapi import CLOSES, asyncapi
from fervor.protocol.codec import JsonCodec
from fervor.protocol.messages import ClientMessage, Estimate, Frame, ServerMessage, SessionStart

DOCUMENT = asyncapi("1.2.3")


def references(value):
    if isinstance(value, dict):
        if "$ref" in value:
            yield value["$ref"]
        for inner in value.values():
            yield from references(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from references(inner)


def test_every_reference_resolves():
    found = set(references(DOCUMENT))
    assert found
    for reference in found:
        at = DOCUMENT
        for part in reference.removeprefix("#/").split("/"):
            at = at[part]


def test_every_message_and_close_code_is_there():
    types = {message["name"] for message in DOCUMENT["components"]["messages"].values()}
    models = [*ClientMessage.__origin__.__args__, *ServerMessage.__origin__.__args__]
    assert types == {model.model_fields["type"].default for model in models}
    assert set(CLOSES) == set(CloseCode)
    assert all(message["summary"] for message in DOCUMENT["components"]["messages"].values())


@pytest.mark.parametrize(
    "message",
    [
        SessionStart(emotion={"joy": 0.5}),
        Frame(seq=1, t=0.5, q=((0, 0, 0, 1), None), mask=(True, False)),
        Estimate(body="0", seq=1, t=0.0, intensity=None, level=None, emotion="joy", status="ok", flags=("late",)),
    ],
)
def test_what_is_sent_fits_the_schema(message):
    schema = DOCUMENT["components"]["schemas"][type(message).__name__] | {"components": DOCUMENT["components"]}
    jsonschema.validate(json.loads(JsonCodec().encode(message)), schema)


def test_the_service_serves_it(http):
    served = http.get("/v1/asyncapi.json").json()
    assert served["channels"] == DOCUMENT["channels"]
    assert served["info"]["version"]
