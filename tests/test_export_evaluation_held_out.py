"""Which clips are new to a model."""

from dataclasses import replace

import pytest

from fervor.errors import DataError
from fervor.skeletons.rig import mirror_pose
from fervor_export.evaluation.held_out import LearnedFrom, held_out, read_learned_from, write_learned_from
from fervor_export.synthetic import synthesise_dataset


@pytest.fixture(scope="module")
def clips():
    made = synthesise_dataset(clips=20, seed=9)
    return [replace(clip, actor=f"actor {index % 5}") for index, clip in enumerate(made)]


def test_recordings_and_actors_that_were_learned_from_are_not_new(clips, tmp_path):
    write_learned_from([clip for clip in clips if clip.actor in {"actor 0", "actor 1"}], tmp_path)
    learned = read_learned_from(tmp_path)
    assert learned.actors == {"actor 0", "actor 1"}
    assert len(learned.recordings) == 8
    kept = held_out(clips, learned, demo=False, procedural=True)
    assert {clip.actor for clip in kept} == {"actor 2", "actor 3", "actor 4"}


def test_a_mirror_image_under_another_name_is_not_new(clips):
    rotations, mask = mirror_pose(clips[0].rotations, clips[0].mask)
    leak = replace(clips[0], rotations=rotations, mask=mask, name="innocent", actor="stranger")
    learned = LearnedFrom(frozenset({clips[0].name}), frozenset({clips[0].actor}))
    kept = held_out([*clips, leak], learned, demo=False, procedural=True)
    assert leak not in kept
    assert clips[1] in kept


def test_nothing_left_or_nothing_known(clips, tmp_path):
    everything = LearnedFrom(frozenset(), frozenset(clip.actor for clip in clips))
    with pytest.raises(DataError, match="all 20 clips; expected some that are new"):
        held_out(clips, everything, demo=False, procedural=True)
    assert read_learned_from(tmp_path) is None
    for demo, procedural in ((False, False), (True, True), (False, True)):
        with pytest.raises(DataError, match="nothing is known to be new"):
            held_out(clips, None, demo=demo, procedural=procedural)
    assert held_out(clips, None, demo=True, procedural=False) == clips
    (tmp_path / "learned_from.json").write_text("{}")
    with pytest.raises(DataError, match="does not list recordings and actors"):
        read_learned_from(tmp_path)
