"""The application as a whole: what it describes, how it says no, and what it never imports."""

import json
import subprocess
import sys

import httpx
import pytest
import websockets

from bodies import model
from fervor import __version__
from fervor.errors import ModelFileError
from fervor.metadata import ModelMetadata
from fervor.server.app import create_app
from fervor.settings import Settings
from live import PROTOCOL, Live, eventually, talk


@pytest.fixture(scope="module")
def document() -> dict:
    return create_app(Settings.load()).openapi()


def test_the_model_is_described_in_full(http: httpx.Client) -> None:
    answer = http.get("/v1/model").json()
    assert answer["sha256"] == model().sha256
    assert answer["fingerprint"] == model().fingerprint
    assert ModelMetadata.model_validate(answer["metadata"]) == model().metadata


def test_a_bad_model_ends_the_start(tmp_path) -> None:
    path = tmp_path / "bad.onnx"
    path.write_bytes(b"no model")
    with pytest.raises(ModelFileError, match=r"bad\.onnx is not an ONNX file"):
        create_app(Settings.load(model=path))


# --- problems ---------------------------------------------------------------------------------------------------------


NO = {
    ("GET", "/nothing"): (404, "not_found", "there is nothing at /nothing"),
    ("GET", "/v1/model/"): (404, "not_found", "there is nothing at /v1/model/"),
    ("DELETE", "/healthz"): (405, "method_not_allowed", "/healthz does not take DELETE"),
    ("GET", "/v1/score"): (405, "method_not_allowed", "/v1/score does not take GET"),
    ("POST", "/v1/score/file?detail=all"): (
        422,
        "bad_request",
        "query detail: input should be 'summary' or 'frames', but 'all' came",
    ),
}


@pytest.mark.parametrize(("request_", "problem"), NO.items())
def test_every_no_is_a_problem(request_: tuple[str, str], problem: tuple[int, str, str], http: httpx.Client) -> None:
    answer = http.request(*request_)
    body = answer.json()
    assert answer.headers["content-type"] == "application/problem+json"
    assert (answer.status_code, body["code"], body["detail"]) == problem
    assert (body["type"], body["status"]) == ("about:blank", answer.status_code)


def test_405_says_what_is_allowed(http: httpx.Client) -> None:
    assert http.delete("/healthz").headers["allow"] == "GET"


async def test_a_fault_of_ours_is_told_without_its_trace(live: Live, monkeypatch, caplog) -> None:
    monkeypatch.setattr("fervor.server.model.describe_model", lambda _: 1 / 0)
    async with httpx.AsyncClient(base_url=live.url) as client:
        answer = await client.get("/v1/model")
    assert answer.status_code == 500
    assert answer.json()["detail"] == "the service failed on this request; the fault is its own and was logged"
    assert "ZeroDivisionError" not in answer.text
    await eventually(lambda: "ZeroDivisionError" in caplog.text)


# --- tokens -----------------------------------------------------------------------------------------------------------


def test_tokens_keep_others_out(start_service) -> None:
    service = start_service(tokens="alpha,beta")
    with httpx.Client(base_url=service.url) as client:
        answer = client.get("/v1/model")
        assert answer.status_code == 401
        assert answer.headers["www-authenticate"] == "Bearer"
        assert "alpha" not in answer.text
        for wrong in ("Bearer gamma", "Bearer alph", "Bearer alphaa", "Bearer", "alpha", "Basic alpha", "Bearer ä"):
            assert client.get("/v1/model", headers={"Authorization": wrong.encode()}).status_code == 401
        for right in ("alpha", "beta"):
            assert client.get("/v1/model", headers={"Authorization": f"Bearer {right}"}).status_code == 200
        assert client.post("/v1/score", json={}).status_code == 401
        assert client.get("/healthz").status_code == 200
        assert client.get("/readyz").status_code == 200


async def test_tokens_open_streams(start_service) -> None:
    service = start_service(tokens="alpha")
    for options in ({}, {"subprotocols": [PROTOCOL, "fervor.token.beta"]}):
        with pytest.raises(websockets.InvalidStatus) as refused:
            async with talk(service, **options):
                pass
        assert refused.value.response.status_code == 401
    async with talk(service, additional_headers={"Authorization": "Bearer alpha"}) as stream:
        assert (await stream.start())["type"] == "session.started"
    async with talk(service, subprotocols=["fervor.token.alpha", PROTOCOL]) as stream:
        assert stream.socket.subprotocol == PROTOCOL  # never the token
        assert (await stream.start())["type"] == "session.started"


# --- the description --------------------------------------------------------------------------------------------------


def test_the_description_is_served(http: httpx.Client, document: dict) -> None:
    assert http.get("/openapi.json").json() == document
    assert document["info"]["version"] == __version__
    assert set(document["paths"]) >= {"/v1/stream", "/v1/score", "/v1/score/file", "/v1/model", "/healthz", "/readyz"}


def test_every_reference_in_it_resolves(document: dict) -> None:
    text = json.dumps(document)
    names = {part.split('"')[0] for part in text.split("#/components/schemas/")[1:]}
    assert names <= set(document["components"]["schemas"])
    assert "#/$defs" not in text


def test_every_operation_says_what_it_does_and_how_it_fails(document: dict) -> None:
    assert "HTTPValidationError" not in json.dumps(document)
    for path, methods in document["paths"].items():
        for operation in methods.values():
            assert operation["description"]
            for status, response in operation["responses"].items():
                if status >= "400":
                    assert list(response["content"]) == ["application/problem+json"], (path, status)


def test_requests_have_examples_that_work(document: dict, http: httpx.Client) -> None:
    schemas = document["components"]["schemas"]
    answer = http.post("/v1/score", json=schemas["ScoreRequest"]["example"])
    assert answer.status_code == 200
    assert schemas["Problem"]["example"]["code"] == "bad_input"


# --- imports ----------------------------------------------------------------------------------------------------------


def test_the_service_runs_without_the_training_side() -> None:
    code = (
        "import sys, fervor.server.run, fervor.server.scoring_worker;"
        "print(sorted({'torch', 'onnx', 'sklearn', 'scipy', 'matplotlib', 'fervor_export'} & set(sys.modules)))"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert ran.stdout.strip() == "[]"
