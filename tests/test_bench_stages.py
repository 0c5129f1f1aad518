"""Samples become stages."""

from pathlib import Path

import pytest

from fervor_bench.stages import REST, read_stacks, share_out

RUN = "run (uvicorn/server.py:75);_listen (fervor/server/conversation.py:80)"


@pytest.mark.parametrize(
    ("stack", "stage"),
    [
        (f"{RUN};_understand (fervor/server/conversation.py:116);decode_client (fervor/protocol/codec.py:44)", "parse"),
        (f"{RUN};receive (fervor/session/session.py:90)", "session"),
        (f"{RUN};receive (fervor/session/session.py:90);quaternions (fervor/protocol/poses.py:30)", "parse"),
        ("_run (fervor/engine/batcher.py:60);run (fervor/engine/engine.py:90);run (fervor/model.py:120)", "model"),
        ("run (fervor/engine/engine.py:90);slerp (fervor/rotations.py:200);concatenate (numpy/lib.py:1)", "engine"),
        ("send_all (fervor/server/outbox.py:50);send (uvicorn/protocols/websockets/x.py:1)", "send"),
        ("data_received (uvicorn/protocols/websockets/websockets_sansio_impl.py:140)", "receive"),
        ("run (asyncio/runners.py:118);run_until_complete (asyncio/base_events.py:1)", REST),
    ],
)
def test_a_sample_belongs_to_the_innermost_part_of_ours(stack: str, stage: str) -> None:
    (found,) = share_out({stack: 3})
    assert found.name.startswith(stage)
    assert found.share == 1.0


def test_shares_are_of_all_samples(tmp_path: Path) -> None:
    path = tmp_path / "stacks"
    path.write_text("f (fervor/model.py:1) 30\ng (fervor/engine/engine.py:2) 10\nf (fervor/model.py:1) 20\n")
    stages = share_out(read_stacks(path))
    assert [(stage.name, round(stage.share, 3)) for stage in stages] == [("model", 0.833), ("engine", 0.167)]
