"""The AsyncAPI document says what the models say, and every reference in it resolves."""

import json

import jsonschema
import pytest

from fervor.errors import CloseCode
from fervor.protocol.asyncapi import CLOSES, asyncapi
from fervor.protocol.codec import CODECS, JsonCodec
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


@pytest.mark.parametrize("name", DOCUMENT["components"]["messages"])
def test_every_example_is_a_message_by_the_schema_and_by_the_codec(name):
    message = DOCUMENT["components"]["messages"][name]
    (example,) = (each["payload"] for each in message["examples"])
    jsonschema.Draft7Validator(message["payload"] | {"components": DOCUMENT["components"]}).validate(example)
    assert example["type"] == message["name"]
    client = name in {kind.__name__ for kind in ClientMessage.__origin__.__args__}
    decode = JsonCodec().decode_client if client else JsonCodec().decode_server
    assert type(decode(json.dumps(example))).__name__ == name


def test_a_quaternion_has_four_numbers_in_the_schema_too():
    schema = DOCUMENT["components"]["messages"]["Frame"]["payload"] | {"components": DOCUMENT["components"]}
    for wrong in (
        {"type": "frame", "seq": 0, "q": [[0, 0, 1]]},
        {"type": "frame", "seq": 0, "q": [[0, 0, 0, "1"]]},
        {"seq": 0},
    ):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.Draft7Validator(schema).validate(wrong)


def test_every_code_that_a_session_tells_is_there():
    codes = {each["code"]: each["closes"] for each in DOCUMENT["x-error-codes"]}
    assert codes["checkpoint_unknown"] == 4404
    assert codes["bad_frame"] is None
    assert {code for code in codes.values() if code} <= {int(code) for code in DOCUMENT["x-close-codes"]}
    assert set(DOCUMENT["x-subprotocols"]) == set(CODECS)


def test_the_service_serves_it(http):
    served = http.get("/v1/asyncapi.json").json()
    assert served["channels"] == DOCUMENT["channels"]
    assert served["info"]["version"]
