"""Keys of checkpoints are rotated while the service runs."""

from pathlib import Path

import pytest

from bodies import motion
from fervor.errors import CheckpointUnknown, InputError
from fervor.server.sealing import parse_keys, seal_and_open
from fervor.settings import Settings
from live import frames_of, talk
from test_server_watched_file import replace

OLD = "an-old-key-that-is-long-enough"
NEW = "a-new-key-that-is-long-enough"


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fervor.server.watched_file.LOOK_EVERY_S", 0.0)


def test_the_first_key_signs_and_all_are_believed_until_they_leave(tmp_path: Path) -> None:
    path = tmp_path / "keys"
    replace(path, OLD)
    seal, unseal = seal_and_open(Settings.load(checkpoint_keys_file=path))
    before = seal(b"before")
    replace(path, f"{NEW}  # since today\n{OLD}\n")
    after = seal(b"after")
    assert (unseal(before), unseal(after)) == (b"before", b"after")
    replace(path, NEW)
    assert unseal(after) == b"after"
    with pytest.raises(CheckpointUnknown, match="not signed with a key of this service"):
        unseal(before)


@pytest.mark.parametrize("text", ["", "short", "two words-that-are-long-enough", f"{OLD}\nshort"])
def test_a_bad_file_of_keys_is_told_without_a_key(text: str) -> None:
    with pytest.raises(InputError) as raised:
        parse_keys(text)
    assert "enough" not in raised.value.message


async def test_a_stream_goes_on_over_a_change_of_keys(start_service, tmp_path: Path) -> None:
    path = tmp_path / "keys"
    replace(path, OLD)
    service = start_service(checkpoint_keys_file=path)
    frames = frames_of(motion(60), rate_hz=30.0)
    async with talk(service) as whole:
        await whole.start(emotion="joy")
        expected = await whole.follow(frames)
    async with talk(service) as first:
        await first.start(emotion="joy", checkpoint_s=0.5)
        for frame in frames[:40]:
            await first.send("frame", **frame)
        heard = [await first.hear() for _ in range(40 + 3)]
    newest = [message for message in heard if message["type"] == "checkpoint"][-1]
    replace(path, f"{NEW}\n{OLD}")
    async with talk(service) as second:
        started = await second.start(emotion="joy", checkpoint_s=0.5, resume=[newest["token"]])
        assert started["type"] == "session.started"
        for frame in frames[newest["seq"] + 1 :]:
            await second.send("frame", **frame)
        rest = []
        while len(rest) < len(frames) - newest["seq"] - 1:
            message = await second.hear()
            rest += [message] if message["type"] == "estimate" else []
    assert rest == expected[newest["seq"] + 1 :]
