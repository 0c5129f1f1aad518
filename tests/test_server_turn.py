"""A turn's messages pass each stage together, in the order in which they came."""

import asyncio
import json
from collections.abc import Sequence

import msgpack
import numpy as np
import pytest

from bodies import as_read, host, model, motion
from fervor.engine.batcher import Batcher, Run
from fervor.engine.engine import Engine
from fervor.errors import EngineError, FervorError
from fervor.protocol.codec import Codec, JsonCodec, MsgpackCodec
from fervor.protocol.lean_frame import LeanFrame, LeanFrames
from fervor.protocol.messages import Estimate, Frame
from fervor.server.turn import Turn
from fervor.session.events import Outcome, Reply, Ticket
from fervor.session.poses import Read
from fervor.session.session import Session
from fervor.session.start import Agreement

CODEC = MsgpackCodec()


class Talk:
    """A session that takes its messages from a turn."""

    def __init__(self, batcher: Batcher, codec: Codec = CODEC) -> None:
        self.batcher = batcher
        self.codec = codec
        self.session = Session("s", host(batcher.engine.claim))
        self.said: list[object] = []
        self.in_blocks = 0
        self.prompted = 0

    @property
    def agreement(self) -> Agreement | None:
        return self.session.agreement

    def decode_frames(self, message: str | bytes) -> LeanFrame | LeanFrames | None:
        return self.codec.decode_frames(message)

    def take(self, message: str | bytes, lean: LeanFrame | LeanFrames | None, poses: Sequence[Read]) -> None:
        self.in_blocks += len(poses)
        try:
            events = self.session.receive(lean or self.codec.decode_client(message), poses)
        except FervorError as error:
            events = self.session.refuse(error)
        self.carry(events)

    def prompt(self, message: LeanFrame | LeanFrames, poses: Sequence[Read]) -> Sequence[Ticket]:
        tickets = self.session.prompt(message, poses)
        self.in_blocks += len(tickets)
        self.prompted += len(tickets)
        return tickets

    def answer(self, tickets: Sequence[Ticket], outcomes: Sequence[Outcome | EngineError]) -> None:
        self.said += map(as_read, self.session.answer(tickets, outcomes))

    def carry(self, events) -> None:
        for event in events:
            if isinstance(event, Ticket):
                self.batcher.submit(event, self.deliver)
            elif isinstance(event, Reply):
                self.said.append(as_read(event.message))

    def deliver(self, ticket: Ticket, outcome: Outcome | EngineError) -> None:
        self.carry(self.session.conclude(ticket, outcome))

    def estimates(self) -> list[Estimate]:
        return [message for message in self.said if isinstance(message, Estimate)]


def start(**more) -> bytes:
    return msgpack.packb({"type": "session.start", "emotion": "joy", **more})


def frames_of_arrays(seed: int, count: int) -> list[dict]:
    """One joint of each is untracked, in one of three ways."""
    poses = motion(count, seed=seed)
    poses[::3, 2] = 0.0
    frames = [{"type": "frame", "seq": seq, "t": seq / 25, "q": pose.tolist()} for seq, pose in enumerate(poses)]
    for frame in frames[1::3]:
        frame["q"][2] = None
    for frame in frames[2::3]:
        frame["mask"] = [joint != 2 for joint in range(13)]
    return frames


def frames(seed: int, count: int) -> list[bytes]:
    poses = motion(count, seed=seed).astype("<f4")
    return [
        msgpack.packb({"type": "frame", "seq": seq, "t": seq / 25, "q": pose.tobytes()})
        for seq, pose in enumerate(poses)
    ]


async def settle(batcher: Batcher, turn: Turn) -> None:
    async with asyncio.timeout(30):
        while turn.depth or batcher.depth:
            await asyncio.sleep(0)


@pytest.fixture
def batcher() -> Batcher:
    return Batcher(Engine(model(), capacity=32))


async def test_estimates_are_those_of_the_plain_way_to_the_bit(batcher: Batcher) -> None:
    turn = Turn(batcher)
    together, alone = ([Talk(batcher) for _ in range(12)] for _ in range(2))
    for talk in (*together, *alone):
        talk.carry(talk.session.receive(CODEC.decode_client(start())))
    for messages in zip(*(frames(seed, 40) for seed in range(12)), strict=True):
        for talk, message in zip(together, messages, strict=True):
            turn.put(talk, message)
        await settle(batcher, turn)
        for talk, message in zip(alone, messages, strict=True):
            talk.carry(talk.session.receive(CODEC.decode_client(message)))
            batcher.run()
    assert [talk.in_blocks for talk in together] == [40] * 12
    assert [talk.prompted for talk in together] == [39] * 12  # all but each body's first
    assert [talk.estimates() for talk in together] == [talk.estimates() for talk in alone]
    assert all(len(talk.estimates()) == 40 for talk in alone)


async def test_so_are_those_of_json_and_of_arrays(batcher: Batcher) -> None:
    turn, json_codec = Turn(batcher), JsonCodec()
    texts, packed, alone = Talk(batcher, json_codec), Talk(batcher), Talk(batcher, json_codec)
    for talk in (texts, packed, alone):
        talk.carry(talk.session.receive(CODEC.decode_client(start())))
    for frame in frames_of_arrays(3, 30):
        turn.put(texts, json.dumps(frame))
        turn.put(packed, msgpack.packb(frame))
        await settle(batcher, turn)
        alone.carry(alone.session.receive(Frame.model_validate_json(json.dumps(frame))))
        batcher.run()
    assert [talk.in_blocks for talk in (texts, packed)] == [30, 30]
    assert texts.estimates() == packed.estimates() == alone.estimates()
    assert len(alone.estimates()) == 30


async def test_one_run_for_a_turn_and_none_for_nothing(batcher: Batcher) -> None:
    turn, runs = Turn(batcher), []
    batcher.watch(runs.append)
    talks = [Talk(batcher) for _ in range(5)]
    for talk in talks:
        turn.put(talk, start())
        turn.put(talk, frames(0, 1)[0])  # behind its own start: read by its session
    await settle(batcher, turn)
    await asyncio.sleep(0)
    assert [run.size for run in runs if isinstance(run, Run)] == [5]
    assert [talk.in_blocks for talk in talks] == [0] * 5
    assert all(len(talk.estimates()) == 1 for talk in talks)


async def test_a_large_turn_is_answered_in_parts() -> None:
    batcher = Batcher(Engine(model(), capacity=600))
    turn, talks, said = Turn(batcher), [Talk(batcher) for _ in range(600)], []
    first, second = frames(0, 2)
    for message in (start(), first):
        for talk in talks:
            turn.put(talk, message)
        await settle(batcher, turn)
    batcher.watch(lambda run: said.append((run.size, sum(talk.estimates()[-1].seq for talk in talks))))
    for talk in talks:
        turn.put(talk, second)
    await settle(batcher, turn)
    assert said == [(256, 0), (256, 256), (88, 512)]
    assert all(talk.estimates()[-1].seq == 1 for talk in talks)


async def test_order_is_kept_between_frames_and_all_else(batcher: Batcher) -> None:
    turn, talk = Turn(batcher), Talk(batcher)
    first, second, third = frames(1, 3)
    reset = msgpack.packb({"type": "body.reset", "body": "0"})
    for message in (start(), first, second, reset, third):
        turn.put(talk, message)
    await settle(batcher, turn)
    assert [estimate.flags for estimate in talk.estimates()][:1] == [()]
    assert [estimate.flags for estimate in talk.estimates()][2] == ("reset",)


async def test_what_comes_behind_a_prompt_frame_waits_for_its_answer(batcher: Batcher) -> None:
    turn, talks = Turn(batcher), [Talk(batcher) for _ in range(3)]
    first, *more = frames(2, 4)
    for talk in talks:
        turn.put(talk, start())
        turn.put(talk, first)
    await settle(batcher, turn)
    end = msgpack.packb({"type": "session.end"})
    for message in (*more, end):
        for talk in talks:
            turn.put(talk, message)
    await settle(batcher, turn)
    for talk in talks:
        assert talk.prompted == 3
        assert [message.type for message in talk.said[1:]] == ["estimate"] * 4 + ["session.ended"]
        assert [estimate.seq for estimate in talk.estimates()] == [0, 1, 2, 3]


async def test_a_prompt_frame_whose_run_failed_is_told(batcher: Batcher, monkeypatch) -> None:
    turn, talk = Turn(batcher), Talk(batcher)
    first, second, third = frames(2, 3)
    for message in (start(), first):
        turn.put(talk, message)
    await settle(batcher, turn)
    with monkeypatch.context() as broken:
        broken.setattr(batcher.engine, "run", lambda tickets: [EngineError("no")] * len(tickets))
        turn.put(talk, second)
        await settle(batcher, turn)
    turn.put(talk, third)
    await settle(batcher, turn)
    assert [message.type for message in talk.said[1:]] == ["estimate", "error", "estimate"]
    assert talk.estimates()[-1].flags == ("reset",)


async def test_a_poisoned_frame_costs_its_neighbours_nothing(batcher: Batcher) -> None:
    turn, talks = Turn(batcher), [Talk(batcher) for _ in range(3)]
    for talk in talks:
        turn.put(talk, start())
    await settle(batcher, turn)
    nan = np.full((13, 4), np.nan, "<f4").tobytes()
    turn.put(talks[0], frames(0, 1)[0])
    turn.put(talks[1], msgpack.packb({"type": "frame", "seq": 0, "t": 0.0, "q": nan}))
    turn.put(talks[2], frames(0, 1)[0])
    await settle(batcher, turn)
    assert talks[0].estimates() == talks[2].estimates() != []
    assert talks[1].estimates() == []
    assert talks[1].said[-1].code == "bad_frame"


async def test_a_fault_in_reading_together_costs_nobody_a_frame(batcher: Batcher, monkeypatch, caplog) -> None:
    def fails(_: object) -> list[Read]:
        raise ValueError("ours")

    monkeypatch.setattr("fervor.server.turn.read_poses", fails)
    turn, talks = Turn(batcher), [Talk(batcher) for _ in range(3)]
    for talk in talks:
        turn.put(talk, start())
        turn.put(talk, frames(0, 1)[0])
    await settle(batcher, turn)
    assert [len(talk.estimates()) for talk in talks] == [1, 1, 1]
    assert "could not be read together" in caplog.text
