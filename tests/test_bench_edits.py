"""Edits of motion do what their name says, and nothing at strength 0."""

from dataclasses import replace

import numpy as np
import pytest
from bench.edits import ARMS, CHEST, HEAD, MORE, SHOULDER, SPINE, Array, Cut, Edit, Source, edited

from fervor.emotions import EMOTIONS
from fervor.rotations import angle_between, from_rotvec, multiply, rotate
from fervor.skeletons.rig import MIRROR

TIMES = np.arange(0.0, 8.0, 1 / 60)


@pytest.fixture(scope="module")
def cut() -> Cut:
    """Arms that swing at 1 Hz, a trunk that nods at half of that."""
    turns = np.zeros((len(TIMES), 13, 3))
    turns[:, ARMS, 0] = 0.5 * np.sin(2.0 * np.pi * TIMES)[:, None]
    turns[:, (SPINE, CHEST, HEAD), 0] = 0.2 * np.sin(np.pi * TIMES)[:, None]
    return Cut(Source("swing", TIMES, from_rotvec(turns)), 4.0, 4.0)


def speed(local: Array) -> float:
    return float(angle_between(local[1:], local[:-1]).mean())


def whole(local: Array, joint: int) -> float:
    """Mean degrees of a joint about the left axis."""
    forward = rotate(local[:, joint], np.array([0.0, 1.0, 0.0]))
    return float(np.degrees(np.arctan2(forward[:, 2], forward[:, 1])).mean())


@pytest.mark.parametrize("emotion", MORE)
def test_nothing_is_edited_at_strength_0(cut: Cut, emotion: str) -> None:
    assert MORE[emotion].scaled(0.0) == Edit()
    expected = cut.source.at(2.0 + cut.times())
    assert np.degrees(angle_between(edited(cut, MORE[emotion].scaled(0.0)), expected)).max() < 1e-4


def test_there_are_edits_for_every_emotion_that_can_be_intense() -> None:
    assert set(MORE) == set(EMOTIONS) - {"neutral"}


def test_tempo_and_size_change_speed_and_only_size_changes_how_far(cut: Cut) -> None:
    plain = edited(cut, Edit())
    fast, wide = edited(cut, Edit(tempo=1.5)), edited(cut, Edit(size=1.5))
    assert speed(fast) / speed(plain) == pytest.approx(1.5, rel=0.05)
    assert speed(wide) / speed(plain) == pytest.approx(1.5, rel=0.05)
    reach = [np.degrees(angle_between(local[:, SHOULDER], plain[:1, SHOULDER])).max() for local in (plain, fast, wide)]
    assert reach[1] == pytest.approx(reach[0], rel=0.05)
    assert reach[2] > 1.2 * reach[0]


def test_stop_and_go_changes_accelerations_more_than_speed(cut: Cut) -> None:
    plain, abrupt, calm = (edited(cut, edit) for edit in (Edit(), Edit(abrupt=0.6), Edit(smooth=0.15)))

    def jolt(local: Array) -> float:
        turned = angle_between(local[1:], local[:-1])
        return float(np.abs(np.diff(turned, axis=0)).mean() / turned.mean())

    assert jolt(abrupt) > 1.2 * jolt(plain)
    assert speed(abrupt) == pytest.approx(speed(plain), rel=0.15)
    assert speed(calm) < speed(plain)


@pytest.mark.parametrize(("edit", "joint", "degrees"), [
    (Edit(head=12.0), HEAD, 12.0), (Edit(bent=10.0), CHEST, 6.0), (Edit(lean=10.0), SPINE, 10.0),
])  # fmt: skip
def test_bodies_bend_forward_by_degrees(cut: Cut, edit: Edit, joint: int, degrees: float) -> None:
    assert whole(edited(cut, edit), joint) - whole(edited(cut, Edit()), joint) == pytest.approx(degrees, abs=0.5)


def test_opened_arms_go_aside_on_both_sides_and_raised_ones_forward(cut: Cut) -> None:
    down = np.array([0.0, -1.0, 0.0])
    for joint, side in ((SHOULDER, 1.0), (MIRROR[SHOULDER], -1.0)):
        hangs, opened, raised = (
            rotate(edited(cut, edit)[:, joint], down).mean(0) for edit in (Edit(), Edit(open=30.0), Edit(raised=30.0))
        )
        assert side * (opened - hangs)[0] > 0.3
        assert (raised - hangs)[2] > 0.3


def test_events_begin_in_the_middle_and_have_no_opposite(cut: Cut) -> None:
    startled = edited(cut, MORE["surprise"].scaled(1.0))
    apart = angle_between(startled, edited(cut, replace(MORE["surprise"], startle=0.0)))
    assert apart[:58].max() < 1e-6 < apart[62:70, SHOULDER].min()
    assert MORE["surprise"].scaled(-0.5).startle == 0.0
    assert MORE["sadness"].scaled(-1.0).tempo == pytest.approx(1.0 / MORE["sadness"].tempo)


def test_trembling_arms_stay_where_they_are(cut: Cut) -> None:
    shaken, plain = edited(cut, Edit(tremor=2.0)), edited(cut, Edit())
    away = np.degrees(angle_between(shaken, plain))
    assert 0.5 < away[:, ARMS].mean() < 4.0
    assert away[:, (SPINE, HEAD)].max() < 1e-4
    assert np.array_equal(shaken, edited(cut, Edit(tremor=2.0)))


def test_beyond_its_ends_a_recording_is_played_to_and_fro() -> None:
    turn = from_rotvec(np.linspace(0.0, 1.0, len(TIMES))[:, None, None] * np.ones((1, 13, 1)) * np.eye(3)[0])
    source = Source("ramp", TIMES, multiply(turn, turn))
    end = float(TIMES[-1])
    inside, outside = source.at(np.array([end - 0.5, 0.5])), source.at(np.array([end + 0.5, -0.5]))
    assert np.allclose(inside, outside)
