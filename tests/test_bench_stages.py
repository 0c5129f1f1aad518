"""Samples become stages."""

import platform
import re
from pathlib import Path

import pytest

from fervor_bench.contestant import CONTESTANTS, started
from fervor_bench.generator import Load
from fervor_bench.machine import choose_places
from fervor_bench.stages import PROGRAM, REST, read_stacks, sampled, share_out, stage_of
from fervor_bench.traffic import Traffic
from fervor_bench.trial import Track

RUN = f"<module> ({PROGRAM}:18);run (fervor/server/run.py:111);run (uvicorn/server.py:75)"
LISTEN = f"{RUN};_listen (fervor/server/conversation.py:80)"
WRITE = "write (fervor/server/websocket_protocol.py:125)"


@pytest.mark.parametrize(
    ("stack", "stage"),
    [
        (f"{LISTEN};decode_client (fervor/protocol/codec.py:44)", "decode"),
        (f"{LISTEN};receive (fervor/session/session.py:90)", "session"),
        (f"{LISTEN};receive (fervor/session/session.py:90);quaternions (fervor/protocol/poses.py:30)", "decode"),
        (f"{LISTEN};conclude (fervor/session/body.py:90);trusted (fervor/protocol/trusted.py:9)", "session"),
        (f"{LISTEN};MsgpackCodec.encode (fervor/protocol/codec.py:99);_pack (msgspec/x.py:3)", "encode"),
        (f"{LISTEN};pack (fervor/session/checkpoint.py:99)", "checkpoint"),
        (f"{LISTEN};run (fervor/engine/engine.py:90);run (fervor/model.py:120)", "model"),
        (f"{LISTEN};run (fervor/engine/engine.py:90);slerp (fervor/rotations.py:200);take (numpy/x.py:1)", "engine"),
        (f"{LISTEN};put (fervor/server/outbox.py:50);{WRITE}", "send"),
        (f"{LISTEN};{WRITE};UVStream_write (stream.c:9);write (libc.so.6)", "kernel: write"),
        (f"{RUN};uv__read (stream.c:1154);read (libc.so.6)", "kernel: read"),
        (f"{RUN};uv__io_poll (linux.c:1154);epoll_pwait (libc.so.6)", "kernel: poll"),
        (f"{RUN};data_received (fervor/server/websocket_protocol.py:78);whole (fervor/server/cutter.py:3)", "receive"),
        (f"{LISTEN};_plan (fervor/session/body.py:1);gc_collect_main (gcmodule.c:1200)", "collector"),
        (f"{RUN};run_until_complete (asyncio/base_events.py:1)", REST),
    ],
)
def test_a_sample_belongs_to_the_innermost_part_of_ours(stack: str, stage: str) -> None:
    (found,) = share_out({stack: 3})
    assert found.name == stage
    assert found.share == 1.0


def test_shares_are_of_all_samples_of_the_programs_thread(tmp_path: Path) -> None:
    path = tmp_path / "stacks"
    path.write_text(
        f"main ({PROGRAM}:1);f (fervor/model.py:1) 30\n"
        f"main ({PROGRAM}:1);g (fervor/engine/engine.py:2) 10\n"
        f"main ({PROGRAM}:1);f (fervor/model.py:1) 20\n"
        "thread_run (libpython3.11.so);pthread_cond_timedwait (libc.so.6) 500\n"
    )
    stages = share_out(read_stacks(path))
    assert [(stage.name, round(stage.share, 3)) for stage in stages] == [("model", 0.833), ("engine", 0.167)]


def test_a_live_sample_has_the_services_stages(workshop: Path) -> None:
    """Rules that the service outgrew would leave its packages to the rest, or to the edge around them."""
    stacks, places = workshop / "live-stacks", choose_places()
    stacks.unlink(missing_ok=True)
    with started(CONTESTANTS["fervor"], workshop, places.server) as running:
        assert running.pid is not None
        track = Track(workshop, places, Traffic())
        with sampled(running.pid, stacks):
            track.run(running, Load(32, "closed", warmup_s=0.2, seconds=3.0))
    found = read_stacks(stacks)
    assert sum(found.values()) > 100
    ours = re.compile(
        r"\(fervor/(protocol/(?!\w*(trusted|messages|estimate))|session|engine|skeletons|rotations|model|levels)"
    )
    for stack in found:
        innermost = next((frame for frame in reversed(stack.split(";")) if "(fervor/" in frame), "")
        assert not ours.search(innermost) or stage_of(stack) not in (REST, "conversation", "send", "receive"), innermost
    names = {stage.name for stage in share_out(found)}
    assert {"decode", "session", "engine", "model", "conversation"} <= names
    if platform.machine() == "x86_64":  # where py-spy sees below the interpreter
        assert {"kernel: write", "kernel: read"} <= names
