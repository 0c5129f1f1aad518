"""Both clients against the real service."""

import asyncio
import contextlib
import io
import itertools
import json
import signal
import subprocess
import sys
import textwrap
import threading
from collections.abc import Callable

import numpy as np
import pytest

import fervor_client
from bodies import motion
from fervor.emotions import EMOTIONS
from fervor.errors import AuthError, FrameError, InputError, Overloaded, ProtocolError, RateExceeded
from fervor.skeletons.rig import SEGMENTS
from live import Live, eventually

RATE_HZ = 60.0


async def follow(url: str, poses: np.ndarray, **options) -> list[fervor_client.Estimate]:
    async with fervor_client.connect(url, **options) as session:
        for number, pose in enumerate(poses):
            await session.send(pose, t=number / RATE_HZ)
        await session.end()
        return [estimate async for estimate in session]


def test_the_example_of_the_package_runs_as_it_stands(live: Live) -> None:
    example = textwrap.dedent((fervor_client.__doc__ or "").partition("\n\n")[2].partition("\n`connect`")[0])
    assert len([line for line in example.splitlines() if line.strip()]) <= 10
    assert "ws://127.0.0.1:8080" in example
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(example.replace("127.0.0.1:8080", live.address), {})
    emotion, rest = said.getvalue().strip().split(": ")
    assert emotion == "joy"
    assert 0.0 <= float(rest.split(",")[0]) <= 1.0


async def test_every_frame_is_answered_once_and_in_order(live: Live) -> None:
    estimates = await follow(live.stream, motion(180), emotion="joy")
    assert [estimate.seq for estimate in estimates] == list(range(180))
    assert all(estimate.emotion == "joy" for estimate in estimates)
    assert {estimate.status for estimate in estimates} == {"warming_up", "ok"}


async def test_both_twins_and_any_pace_give_the_same_estimates_to_the_bit(live: Live) -> None:
    poses = motion(90)
    streamed = await follow(live.stream, poses, emotion="fear")
    async with fervor_client.connect(live.stream, emotion="fear") as session:
        stepwise = [await session.estimate(pose, t=n / RATE_HZ) for n, pose in enumerate(poses)]

    def in_a_thread() -> list[fervor_client.Estimate]:
        with fervor_client.sync.connect(live.stream, emotion="fear", window=7) as session:
            for number, pose in enumerate(poses):
                session.send(pose, t=number / RATE_HZ)
            session.end()
            return list(session)

    assert streamed == stepwise == await asyncio.to_thread(in_a_thread)


async def test_an_untracked_joint_is_the_same_as_none_nan_zero_or_mask(live: Live) -> None:
    poses = motion(60)
    ways: list[Callable[[np.ndarray], dict]] = [
        lambda pose: {"pose": [None if joint == 4 else row for joint, row in enumerate(pose.tolist())]},
        lambda pose: {"pose": np.where(np.arange(13)[:, None] == 4, np.nan, pose)},
        lambda pose: {"pose": np.where(np.arange(13)[:, None] == 4, 0.0, pose)},
        lambda pose: {"pose": pose, "mask": [joint != 4 for joint in range(13)]},
    ]
    told = []
    for way in ways:
        async with fervor_client.connect(live.stream, emotion="joy") as session:
            told.append([(await session.estimate(**way(pose), t=n / 60)).intensity for n, pose in enumerate(poses)])
    assert told[0] == told[1] == told[2] == told[3]


async def test_a_landmark_sensor_sends_positions(live: Live) -> None:
    points = np.random.default_rng(0).normal(size=(33, 3))
    async with fervor_client.connect(live.stream, skeleton="mediapipe", emotion="joy") as session:
        first = await session.estimate(points, t=0.0)
        nobody = await session.estimate([None] * 33, t=0.1)
        with pytest.raises(FrameError, match="expected positions"):
            await session.estimate(np.tile([0.0, 0.0, 0.0, 1.0], (33, 1)), t=0.2)
    assert first.intensity is not None
    assert (nobody.status, nobody.flags) == ("insufficient", ("lost",))


async def test_two_bodies_do_not_touch_each_other(live: Live) -> None:
    ann, bob = motion(60, seed=1), motion(60, seed=2)
    alone = [await follow(live.stream, poses, emotion="joy") for poses in (ann, bob)]
    async with fervor_client.connect(live.stream, emotion="joy") as session:
        for number in range(60):
            await session.send(ann[number], body="ann", t=number / RATE_HZ)
            await session.send(bob[number], body="bob", t=number / RATE_HZ)
        totals = await session.end()
        together = [estimate async for estimate in session]
    assert totals.estimates == 120
    for body, before in zip(("ann", "bob"), alone, strict=True):
        assert [e.intensity for e in together if e.body == body] == [e.intensity for e in before]


async def test_a_bad_frame_is_told_and_leaves_no_trace(live: Live) -> None:
    poses = motion(30)
    expected = await follow(live.stream, poses, emotion="joy")
    async with fervor_client.connect(live.stream, emotion="joy") as session:
        told = [await session.estimate(pose, t=n / RATE_HZ) for n, pose in enumerate(poses[:15])]
        with pytest.raises(FrameError, match="quaternion far from unit length at joint 0") as caught:
            await session.estimate(poses[15] * 9.0, t=15 / RATE_HZ)
        assert caught.value.seq == 15
        with pytest.raises(InputError, match="emotion 'ennui' is not known"):
            await session.estimate(poses[15], t=15 / RATE_HZ, emotion="ennui")
        told += [await session.estimate(pose, t=n / RATE_HZ, seq=n + 2) for n, pose in enumerate(poses) if n >= 15]
    assert [estimate.intensity for estimate in told] == [estimate.intensity for estimate in expected]


async def test_a_label_changes_on_the_way(live: Live) -> None:
    async with fervor_client.connect(live.stream) as session:
        labels = [None, "happy", None, {"sadness": 0.75, "joy": 0.25}, "unknown"]
        told = [await session.estimate(motion(1)[0], t=n / 30, emotion=label) for n, label in enumerate(labels)]
    assert [estimate.emotion for estimate in told] == ["unknown", "joy", "joy", "sadness", "unknown"]


async def test_estimates_under_every_emotion_come_where_asked_for(live: Live) -> None:
    (estimate,) = await follow(live.stream, motion(1), emotion="joy", by_emotion=True)
    assert estimate.by_emotion is not None
    assert tuple(estimate.by_emotion) == EMOTIONS
    assert estimate.by_emotion["joy"] == estimate.intensity


async def test_only_the_newest_estimates_come_under_delivery_latest(live: Live) -> None:
    poses = motion(300)
    async with fervor_client.connect(live.stream, emotion="joy", delivery="latest") as session:
        for number, pose in enumerate(poses):
            await session.send(pose, t=number / RATE_HZ)
        await session.end()
        seqs = [estimate.seq async for estimate in session]
        assert session.in_flight == 0
    assert seqs == sorted(set(seqs))
    assert seqs[-1] == 299


async def test_a_body_is_reset_and_ended(live: Live) -> None:
    pose = motion(1)[0]
    errors: list[Exception] = []
    async with fervor_client.connect(live.stream, on_error=errors.append) as session:
        await session.estimate(pose, t=0.0)
        await session.reset_body()
        assert "reset" in (await session.estimate(pose, t=0.1)).flags
        await session.end_body("0")
        await session.end_body("nobody")
        await session.end()
    assert [str(error) for error in errors] == ["body 'nobody' is not known in this session; it has sent no frame yet"]


def strange() -> fervor_client.SkeletonSpec:
    return fervor_client.SkeletonSpec(
        name="strange",
        joints=SEGMENTS,
        parents=(-1,) * 14,
        segments={name: name for name in SEGMENTS},
        axes="global",
    )


async def test_a_strange_sensor_is_calibrated_and_its_skeleton_used_again(live: Live) -> None:
    turned = np.tile([0.5, 0.5, 0.5, 0.5], (14, 1))
    async with fervor_client.connect(live.stream, skeleton=strange()) as session:
        under_way = asyncio.create_task(session.calibrate(pose="n", seconds=0.5, name="lab"))
        number = 0
        while not under_way.done():
            await session.estimate(turned, t=number / 30)
            number += 1
        found = await under_way
    assert (found.skeleton.name, found.spread_deg) == ("lab", pytest.approx(0.0, abs=1e-5))
    kept = fervor_client.SkeletonSpec.model_validate_json(found.skeleton.model_dump_json())
    async with (
        fervor_client.connect(live.stream, skeleton=kept, emotion="joy") as again,
        fervor_client.connect(live.stream, emotion="joy") as plain,
    ):
        still = np.tile([0.0, 0.0, 0.0, 1.0], (13, 1))
        assert (await again.estimate(turned, t=0.0)).intensity == (await plain.estimate(still, t=0.0)).intensity


async def test_two_calibrations_at_once_are_told_apart(live: Live) -> None:
    """One that nobody held a pose for is replaced; one that was about to be answered has its own answer."""
    turned = np.tile([0.5, 0.5, 0.5, 0.5], (14, 1))
    async with fervor_client.connect(live.stream, skeleton=strange()) as session:
        replaced = asyncio.create_task(session.calibrate(body="nobody", name="first"))
        await asyncio.sleep(0)  # it is asked
        second = asyncio.create_task(session.calibrate(seconds=0.5, name="second"))
        with pytest.raises(InputError, match="another calibration took the place of this one"):
            await replaced
        for number in range(16):
            await session.send(turned, t=number / 30)
        third = asyncio.create_task(session.calibrate(seconds=0.2, name="third"))
        await asyncio.sleep(0)
        for number in range(16, 25):
            await session.send(turned, t=number / 30)
        assert [(await each).skeleton.name for each in (second, third)] == ["second", "third"]


def test_a_calibration_while_moving_fails_and_the_session_goes_on(live: Live) -> None:
    with fervor_client.sync.connect(live.stream, skeleton=strange()) as session:
        over = threading.Event()

        def move() -> None:
            for number, pose in enumerate(motion(2000, joints=14, speed=0.5)):
                session.estimate(pose, t=number / 30)
                if over.is_set():
                    return

        mover = threading.Thread(target=move)
        mover.start()
        with pytest.raises(InputError, match="still"):
            session.calibrate(seconds=0.5)
        over.set()
        mover.join(20)
        with pytest.raises(InputError, match="seconds"):
            session.calibrate(seconds=100.0)


async def test_a_recalibration_that_gets_no_frames_is_told(live: Live) -> None:
    async with fervor_client.connect(live.stream, skeleton=strange()) as session:
        with pytest.raises(TimeoutError, match="is the pose being sent"):
            await session.calibrate(timeout=0.01)


async def test_an_unknown_skeleton_or_emotion_is_told_by_connect(live: Live) -> None:
    with pytest.raises(ProtocolError, match="octopus"):
        await fervor_client.connect(live.stream, skeleton="octopus")
    with pytest.raises(ProtocolError, match="ennui"):
        await fervor_client.connect(live.stream, emotion="ennui")


async def test_a_path_without_a_stream_is_told(live: Live) -> None:
    with pytest.raises(InputError, match=r"there is no stream at .*; expected an address that ends in /v1/stream"):
        await fervor_client.connect(f"ws://{live.address}/v1/strem")


async def test_a_full_service_says_when_to_try_again(start_service: Callable[..., Live]) -> None:
    service = start_service(max_sessions=1)
    async with fervor_client.connect(service.stream):
        with pytest.raises(Overloaded, match="try again after 1 s") as caught:
            await fervor_client.connect(service.stream)
        assert caught.value.retry_after == 1.0


async def test_a_token_opens_what_is_closed(start_service: Callable[..., Live]) -> None:
    service = start_service(tokens="sesame")
    with pytest.raises(AuthError, match="wants a token"):
        await fervor_client.connect(service.stream)
    async with fervor_client.connect(service.stream, token="sesame") as session:
        assert session.model.purpose == "demo"


async def test_too_many_frames_a_second_end_the_session_with_a_word(start_service: Callable[..., Live]) -> None:
    service = start_service(max_frames_per_second=50.0, max_frames_per_message=50)
    async with fervor_client.connect(service.stream) as session:

        async def hurry() -> None:
            for number, pose in enumerate(motion(200)):
                await session.estimate(pose, t=number / RATE_HZ)

        with pytest.raises(RateExceeded, match="more than 50 frames a second"):
            await hurry()


async def test_a_service_that_stops_says_so_to_who_waits(start_service: Callable[..., Live]) -> None:
    service = start_service(shutdown_grace_s=1)
    async with fervor_client.connect(service.stream, resume=False) as session:
        await session.estimate(motion(1)[0])
        await asyncio.to_thread(service.stop)
        with pytest.raises(fervor_client.Unreachable, match=r"closed the connection \(code 1012"):
            await session.recv()


async def test_a_session_with_nobody_in_view_outlives_the_idle_timeout(start_service: Callable[..., Live]) -> None:
    service = start_service(idle_timeout_s=0.3)
    async with fervor_client.connect(service.stream) as session:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.0):
                await session.recv()
        assert (await session.estimate(motion(1)[0])).seq == 0


def test_an_estimate_is_a_line_of_json_and_back(live: Live) -> None:
    with fervor_client.sync.connect(live.stream) as session:
        estimate = session.estimate(motion(1)[0], t=0.0)
    assert fervor_client.Estimate.model_validate(json.loads(estimate.model_dump_json())) == estimate


# --- being stopped ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("reads", [True, False])
async def test_a_task_that_is_cancelled_in_mid_stream_leaves_nothing(live: Live, reads: bool) -> None:
    before, under_way = asyncio.all_tasks(), asyncio.Event()

    async def stream() -> None:
        async with fervor_client.connect(live.stream, checkpoint_s=0.1, window=20) as session:
            for number, pose in enumerate(itertools.cycle(motion(60))):
                await session.send(pose, t=number / RATE_HZ)
                if number == 100:
                    under_way.set()
                    while reads:
                        await session.recv()

    task = asyncio.create_task(stream())
    await under_way.wait()
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await asyncio.wait_for(task, 30)
    assert asyncio.all_tasks() == before
    await eventually(lambda: live.service.sessions.open == 0)


SYNC = """
import itertools, sys, fervor_client
with fervor_client.sync.connect(sys.argv[1], checkpoint_s=0.1) as session:
    for number in itertools.count():
        session.send([[0, 0, 0, 1]] * 13, t=number / 60)
        if number == 100:
            print("under way", flush=True)
"""
ASYNC = """
import asyncio, itertools, sys, fervor_client
async def stream():
    async with fervor_client.connect(sys.argv[1], checkpoint_s=0.1) as session:
        for number in itertools.count():
            await session.send([[0, 0, 0, 1]] * 13, t=number / 60)
            if number == 100:
                print("under way", flush=True)
asyncio.run(stream())
"""


@pytest.mark.parametrize("program", [SYNC, ASYNC], ids=["sync", "async"])
def test_ctrl_c_ends_a_program_at_once_and_quietly(live: Live, program: str) -> None:
    process = subprocess.Popen(
        [sys.executable, "-X", "dev", "-c", program, live.stream],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "under way\n"
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert process.returncode == -signal.SIGINT
    assert said.rstrip().endswith("KeyboardInterrupt")
    for complaint in ("Exception in thread", "Exception ignored", "Warning", "was destroyed", "never retrieved"):
        assert complaint not in said, said
