"""Web pages of other sites are kept out unless they are on the list; what is no browser is not bound by it."""

import httpx
import pytest
import websockets

from fervor.errors import OriginRefused
from fervor.server.origins import Origins
from fervor.settings import Settings, SettingsError
from live import Live, talk

ELSEWHERE = "https://elsewhere.example"


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        (None, "robot.local:8080"),
        ("http://robot.local:8080", "robot.local:8080"),
        ("https://robot.local", "robot.local:443"),
        ("http://robot.local", "robot.local"),
        ("HTTPS://App.Example:8443", "robot.local"),
        ("http://[::1]:8080", "[::1]:8080"),
    ],
)
def test_its_own_pages_and_those_on_the_list_may(origin: str | None, host: str) -> None:
    Origins(("https://app.example:8443",)).check(origin, host)


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("http://robot.local:8081", "robot.local:8080"),
        ("https://app.example", "robot.local"),
        ("https://app.example:8443.evil.example", "robot.local"),
        ("null", "robot.local"),
        ("", "robot.local"),
        ("", ""),
        ("https://", ""),
        ("http://[", "["),
        ("http://robot.local:x", "robot.local"),
    ],
)
def test_others_may_not(origin: str, host: str) -> None:
    with pytest.raises(OriginRefused, match="may not use this service"):
        Origins(("https://app.example:8443",)).check(origin, host)


def test_a_star_lets_all_in() -> None:
    Origins(("*",)).check("null", "robot.local")


@pytest.mark.parametrize("wrong", ["robot.local", "https://robot.local/page", "https://a@b", "https://"])
def test_a_setting_that_is_no_origin_is_refused(wrong: str) -> None:
    with pytest.raises(SettingsError, match="is no web origin"):
        Settings.load(origins=f"https://good.example,{wrong}")


async def test_a_foreign_page_opens_no_stream_and_sends_no_request(live: Live) -> None:
    with pytest.raises(websockets.InvalidStatus) as refused:
        async with talk(live, origin=ELSEWHERE):
            pass
    assert refused.value.response.status_code == 403
    assert b'"code":"origin_refused"' in refused.value.response.body
    async with talk(live, origin=live.url) as own:
        assert (await own.start())["type"] == "session.started"
    async with httpx.AsyncClient(base_url=live.url) as client:
        answer = await client.post("/v1/score", json={}, headers={"Origin": ELSEWHERE})
        assert (answer.status_code, answer.json()["code"]) == (403, "origin_refused")
        assert "access-control-allow-origin" not in answer.headers
        assert (await client.get("/healthz", headers={"Origin": ELSEWHERE})).status_code == 200


async def test_a_page_on_the_list_may_do_both(start_service) -> None:
    service = start_service(origins=f"{ELSEWHERE},https://other.example", tokens="alpha")
    async with talk(service, origin=ELSEWHERE, additional_headers={"Authorization": "Bearer alpha"}) as stream:
        assert (await stream.start())["type"] == "session.started"
    ask = {"Origin": ELSEWHERE, "Access-Control-Request-Method": "POST"}
    async with httpx.AsyncClient(base_url=service.url) as client:
        asked = await client.options(
            "/v1/score", headers={**ask, "Access-Control-Request-Headers": "authorization, content-type"}
        )
        assert asked.status_code == 200
        assert asked.headers["access-control-allow-origin"] == ELSEWHERE
        for token, status in (("alpha", 200), ("beta", 401)):
            answer = await client.get("/v1/model", headers={"Origin": ELSEWHERE, "Authorization": f"Bearer {token}"})
            assert answer.status_code == status
            assert answer.headers["access-control-allow-origin"] == ELSEWHERE  # so that the page can read the problem
