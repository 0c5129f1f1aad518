"""The page's TypeScript names the fields that the service sends, and no other."""

import re

import pytest
from pydantic import BaseModel

from fervor.server.watch_messages import BodyName, Look, SeenBody, SeenSession, Snapshot, WatchStarted
from pages import ROOT

SOURCE = (ROOT / "page" / "src" / "messages.ts").read_text(encoding="utf-8")


@pytest.mark.parametrize("message", [BodyName, Look, SeenBody, SeenSession, Snapshot, WatchStarted])
def test_fields_are_those_of_the_page(message: type[BaseModel]) -> None:
    found = re.search(rf"^export interface {message.__name__} {{$(.*?)^}}$", SOURCE, re.MULTILINE | re.DOTALL)
    assert found, message.__name__
    told = set(re.findall(r"readonly (\w+):", found[1])) - {"type"}
    assert told == set(message.model_fields) - {"type"}
