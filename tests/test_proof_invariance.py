"""One motion through a real service: whatever saw it, from wherever, on whatever body, the estimates are the same.

Equal to 1e-4 to the same motion sent as C13 with the same joints masked, under all eleven emotions. Landmark sensors,
which see less of a motion than its rotations, are equal among themselves; `bench.invariance` measures what they lose.
"""

from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fervor.recordings.bvh import read_bvh
from fervor.recordings.recording import Recording, rig_poses
from fervor.recordings.writer import write_recording
from fervor.skeletons.canonical import C13
from fervor.skeletons.catalog import SKELETONS, skeleton
from fervor.skeletons.landmarks import LANDMARKS
from fervor_export.synthetic import synthesise_motion
from fervor_export.synthetic.sample import ENDS, TREE
from live import Live, talk
from sensors import BUILDS, Array, Build, as_seen, landmarked, rendered, t_pose

EQUAL = 1e-4
RATE = 30.0
CAMERAS = [Rotation.random(random_state=place) for place in range(10)]
HEADINGS = [Rotation.from_euler("y", 36.0 * place, degrees=True) for place in range(10)]
"""Where a person in a suit faces."""

SENSORS = [name for name in SKELETONS if name != "c13"]
XSENS = skeleton("xsens_mvn")
TO_MVN = Rotation.from_matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""Left, up, forward to MVN's forward, left, up."""


@cache
def joy(rate: float = RATE, seconds: float = 4.0) -> Array:
    """Somebody grows joyful [frame, 13, 4], seen at 120 Hz or a part of it."""
    whole = synthesise_motion(emotion="joy", intensity=lambda t: t / seconds, seconds=seconds, seed=3, rate_hz=120.0)
    return whole[1][:: round(120.0 / rate)]


async def watch(
    live: Live, bodies: Sequence[Array], *, key: str = "q", times: Array | None = None, **start: Any
) -> Array:
    """Intensities [body, frame, emotion] of motions [frame, joint, 4 or 3] seen side by side; NaN: not tracked."""
    times = np.arange(len(bodies[0])) / RATE if times is None else times
    sent = [np.where(np.isnan(motion).any(axis=-1, keepdims=True), None, motion).tolist() for motion in bodies]
    async with talk(live) as stream:
        await stream.start(by_emotion=True, **start)
        heard = []
        for seq, time in enumerate(times.tolist()):
            poses = [[None if joint[0] is None else joint for joint in motion[seq]] for motion in sent]
            frames = [{"body": str(n), "seq": seq, "t": time, key: pose} for n, pose in enumerate(poses)]
            await stream.send("frames", frames=frames)
            if seq >= 8:  # so many messages are under way
                heard.append(await stream.hear())
        heard += [await stream.hear() for _ in range(min(8, len(times)))]
    return np.array([[list(e["by_emotion"].values()) for e in answer["estimates"]] for answer in heard]).swapaxes(0, 1)


def masked(local: Array, seen: Iterable[bool]) -> Array:
    return np.where(np.array(list(seen))[:, None], local, np.nan)


# --- rotations --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axes", ["global", "local"])
@pytest.mark.parametrize("name", SENSORS)
async def test_sensors_of_rotations_from_ten_places(name: str, axes: str, live: Live) -> None:
    source = skeleton(name)
    motion = as_seen(source, joy()[:: 1 if axes == source.axes else 3])  # what a sensor does not do by itself: shorter
    bodies = [rendered(source, motion, camera, axes=axes, seed=place) for place, camera in enumerate(CAMERAS)]
    seen = await watch(live, bodies, skeleton=name, axes=axes, quaternion="xyzw")
    (expected,) = await watch(live, [masked(motion, source.sees)])
    assert np.abs(seen - expected).max() < EQUAL
    assert expected.std(axis=0).max() > 0.02, "there is something to see"


async def test_order_of_quaternions_is_that_of_the_sensor(live: Live) -> None:
    source, motion = skeleton("azure_kinect"), joy()[:30]
    w_first = np.roll(rendered(source, motion, CAMERAS[0]), 1, axis=-1)
    (seen,), (expected,) = [await watch(live, [w_first], skeleton="azure_kinect"), await watch(live, [motion])]
    assert np.abs(seen - expected).max() < EQUAL


# --- files ------------------------------------------------------------------------------------------------------------


def mvnx(local: Array, build: Build, heading: Rotation) -> str:
    """A file like MVN's: a T-pose, then the motion, with positions of a body of that size."""
    camera = TO_MVN * heading
    turns = np.roll(rendered(XSENS, local, camera), 1, axis=-1).reshape(len(local), -1)
    held = np.roll(rendered(XSENS, t_pose()[None], camera), 1, axis=-1).ravel()
    places = np.tile(camera.apply([0.1, 0.9, 0.3]) * build.height + [3.0, 1.0, 0.0], len(XSENS.joints))

    def frame(attributes: str, orientation: Array) -> str:
        position = " ".join(f"{number:.6f}" for number in places)
        turned = " ".join(f"{number:.9f}" for number in orientation)
        return f"<frame {attributes}><orientation>{turned}</orientation><position>{position}</position></frame>"

    segments = "".join(f'<segment label="{name}" id="{n + 1}"/>' for n, name in enumerate(XSENS.joints))
    normal = [frame(f'time="{n * 1000 // 30}" index="{n}" type="normal"', row) for n, row in enumerate(turns)]
    frames = "".join([frame('type="tpose"', held), *normal])
    subject = f'<subject label="eve" frameRate="30"><segments>{segments}</segments><frames>{frames}</frames></subject>'
    return f'<?xml version="1.0"?><mvnx version="4">{subject}</mvnx>'


def bvh(local: Array, build: Build, camera: Rotation) -> str:
    """A file like EBMDB's, of a body of that size which stands and faces anywhere."""
    angles = np.zeros((len(local), len(TREE), 3))
    angles[:, 0] = camera.as_euler("YXZ", degrees=True)
    for node, (_, _, _, joint) in enumerate(TREE):
        if joint is not None:
            angles[:, node] = Rotation.from_quat(local[:, joint]).as_euler("YXZ", degrees=True)
    place = " ".join(f"{number:.3f}" for number in camera.apply([30.0, 95.0, 10.0]) * build.height)
    rows = [f"{place} " + " ".join(f"{angle:.9f}" for angle in frame) for frame in angles.reshape(len(local), -1)]

    def node(name: str) -> list[str]:
        offset = next(offset for other, _, offset, _ in TREE if other == name)
        below = [line for child, above, _, _ in TREE if above == name for line in node(child)]
        below += ["End Site {", scaled(ENDS[name]), "}"] if name in ENDS else []
        channels = "CHANNELS 3" if name != "Hips" else "CHANNELS 6 Xposition Yposition Zposition"
        head = f"{'ROOT' if name == 'Hips' else 'JOINT'} {name} {{"
        return [head, scaled(offset), f"{channels} Yrotation Xrotation Zrotation", *below, "}"]

    def scaled(offset: tuple[float, float, float]) -> str:
        return "OFFSET " + " ".join(f"{number * build.height * build.arms:.6f}" for number in offset)

    motion = ["MOTION", f"Frames: {len(local)}", f"Frame Time: {1 / RATE:.10f}", *rows]
    return "\n".join(["HIERARCHY", *node("Hips"), *motion]) + "\n"


def score_files(live: Live, files: Sequence[tuple[str, str]]) -> Array:
    """Intensities [file, frame, emotion] of files (name, text)."""
    form = [("file", (name, text.encode())) for name, text in files]
    with httpx.Client(base_url=live.url, timeout=60) as client:
        answer = client.post("/v1/score/file", files=form, params={"detail": "frames", "by_emotion": "true"})
    assert answer.status_code == 200, answer.text
    return np.array(
        [[list(e["by_emotion"].values()) for e in take["estimates"]] for take in answer.json()["sequences"]]
    )


@pytest.mark.parametrize(
    ("kind", "write", "placements"), [("mvnx", mvnx, HEADINGS), ("bvh", bvh, CAMERAS)], ids=["mvnx", "bvh"]
)
async def test_files_of_four_bodies_in_ten_places(kind, write, placements, live: Live) -> None:
    motion = joy(seconds=2.0)
    files = [write(motion, build, placement) for build in BUILDS for placement in placements]
    assert len(set(files)) == 40
    seen = np.concatenate(
        [
            score_files(live, [(f"take{n}.{kind}", text) for n, text in enumerate(files[k : k + 10])])
            for k in range(0, 40, 10)
        ]
    )
    (expected,) = await watch(live, [motion])
    assert np.abs(seen - expected).max() < EQUAL


async def test_a_real_motion_in_a_file_and_as_every_sensor(live: Live, shared_data: Path, tmp_path: Path) -> None:
    """Somebody laughs, recorded in a suit, with joints that reach their limits."""
    real = read_bvh(shared_data / "cmu" / "79_70.bvh")
    motion = rig_poses(real)[1][200:560:4]
    take = Recording("laugh", C13, np.arange(90) / RATE, motion, np.ones((90, 13), np.bool_), "local")
    write_recording(take, tmp_path / "laugh.bvh")
    (expected,) = await watch(live, [motion])
    files = [("laugh.bvh", (tmp_path / "laugh.bvh").read_text()), *(
        (f"laugh{n}.mvnx", mvnx(motion, build, HEADINGS[n])) for n, build in enumerate(BUILDS)
    )]  # fmt: skip
    assert np.abs(score_files(live, files) - expected).max() < EQUAL
    for name in ("kinect_v2", "azure_kinect", "smpl", "ros4hri", "nite"):
        source = skeleton(name)
        coarse = as_seen(source, motion)
        seen = await watch(live, [rendered(source, coarse, CAMERAS[1])], skeleton=name, quaternion="xyzw")
        assert np.abs(seen - await watch(live, [masked(coarse, source.sees)])).max() < EQUAL, name


# --- positions --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", LANDMARKS)
async def test_landmark_sensors_from_ten_places_on_four_bodies(name: str, live: Live) -> None:
    source, motion = LANDMARKS[name], joy()
    (expected,) = await watch(live, [landmarked(source, motion)], key="p", skeleton=name)
    assert expected.std(axis=0).max() > 0.02, "there is something to see"
    for build in BUILDS:
        bodies = [landmarked(source, motion, build, camera, seed=place) for place, camera in enumerate(CAMERAS)]
        seen = await watch(live, bodies, key="p", skeleton=name)
        assert np.abs(seen - expected).max() < EQUAL


# --- time -------------------------------------------------------------------------------------------------------------


async def at_instants(live: Live, rate: float, kept: Array | None = None) -> dict[int, Array]:
    """Intensities by time in 1/120 s, from a stream of `rate` of which only the frames `kept` arrive."""
    motion = joy(rate, 8.0)
    kept = np.arange(len(motion)) if kept is None else kept
    (seen,) = await watch(live, [motion[kept]], times=kept / rate)
    return {round(at * 120 / rate): values for at, values in zip(kept.tolist(), seen, strict=True)}


def apart(one: dict[int, Array], other: dict[int, Array]) -> Array:
    """Differences [instant, emotion] where both have an estimate, after the first second."""
    shared = sorted(at for at in one.keys() & other.keys() if at >= 120)
    assert len(shared) > 60
    return np.abs(np.array([one[at] - other[at] for at in shared]))


async def test_faster_sensors_change_nothing(live: Live) -> None:
    plain = await at_instants(live, 30.0)
    for rate in (60.0, 120.0):
        assert apart(await at_instants(live, rate), plain).max() < EQUAL


async def test_slower_sensors_and_lost_frames_change_little(live: Live) -> None:
    """The table of docs/reference/invariance.md says how little on average; these are limits for any model."""
    plain = await at_instants(live, 30.0)
    random = np.random.default_rng(0)
    assert apart(await at_instants(live, 15.0), plain).mean() < 0.05
    for share, limit in ((0.05, 0.02), (0.30, 0.05)):
        kept = np.flatnonzero(random.random(240) >= share)
        kept = np.union1d(kept, [0])  # the first frame sets the grid
        assert apart(await at_instants(live, 30.0, kept), plain).mean() < limit


async def test_a_first_frame_at_any_time_is_the_start(live: Live) -> None:
    motion = joy()
    (expected,) = await watch(live, [motion])
    for origin in (-7.0, 1e6, 1.7e9):
        (seen,) = await watch(live, [motion], times=origin + np.arange(len(motion)) / RATE)
        assert np.abs(seen - expected).max() < 1e-3
