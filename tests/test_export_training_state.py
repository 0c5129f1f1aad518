"""Training that is stopped goes on as if it had not been, and never as another one."""

from dataclasses import replace

import pytest
import torch

from fervor.errors import InputError
from fervor_export.recipe import DEFAULT, PAPER
from fervor_export.training import TrainingResult, split_by_actor, train
from fervor_export.training_state import TrainingState, identity, name_of
from networks import waving_clips

SPLIT = split_by_actor(waving_clips(60), seed=1)
RECIPES = (
    replace(DEFAULT, epochs=4, batch_size=16, learning_rate=5e-3),
    replace(PAPER, epochs=4, batch_size=16),
)


class Stop(Exception):
    """What ends a run in the middle."""


def stopped_after(epochs: int, *arguments, **options) -> None:
    def stop(epoch):
        if epoch.number == epochs:
            raise Stop

    with pytest.raises(Stop):
        train(*arguments, on_epoch=stop, **options)


def same(here: TrainingResult, there: TrainingResult) -> None:
    assert [replace(epoch, seconds=0) for epoch in here.history] == [
        replace(epoch, seconds=0) for epoch in there.history
    ]
    assert (here.kept.number, here.stopped) == (there.kept.number, there.stopped)
    for name, weight in here.network.state_dict().items():
        assert torch.equal(weight, there.network.state_dict()[name]), name


@pytest.mark.parametrize("recipe", RECIPES, ids=lambda recipe: recipe.name)
def test_stopped_twice_it_ends_with_the_same_bits(recipe, tmp_path):
    state = tmp_path / "deep" / "training.pt"
    stopped_after(1, *SPLIT, recipe, seed=5, state=state)
    stopped_after(3, *SPLIT, recipe, seed=5, state=state)
    epochs = []
    resumed = train(*SPLIT, recipe, seed=5, state=state, on_epoch=epochs.append)
    assert [epoch.number for epoch in epochs] == [4]
    same(resumed, train(*SPLIT, recipe, seed=5))
    assert sorted(resumed.history, key=lambda epoch: epoch.seconds) == list(resumed.history)


def test_what_is_done_is_not_done_again(tmp_path):
    state = tmp_path / "training.pt"
    recipe = replace(RECIPES[0], epochs=2)
    first = train(*SPLIT, recipe, seed=5, state=state)
    same(train(*SPLIT, recipe, seed=5, state=state, on_epoch=lambda _: pytest.fail("trained again")), first)


def test_more_minutes_go_on(tmp_path):
    state = tmp_path / "training.pt"
    hurried = train(*SPLIT, RECIPES[0], seed=5, state=state, max_minutes=0)
    assert (hurried.stopped, len(hurried.history)) == ("time", 1)
    same(train(*SPLIT, RECIPES[0], seed=5, state=state), train(*SPLIT, RECIPES[0], seed=5))


def test_another_training_is_refused(tmp_path):
    state = tmp_path / "training.pt"
    stopped_after(1, *SPLIT, RECIPES[0], seed=5, state=state)
    before = state.read_bytes()
    learn, validate = SPLIT
    for arguments, seed, told in (
        ((learn, validate, RECIPES[0]), 6, r"go on there: seed 5 instead of 6$"),
        ((learn[1:], validate, RECIPES[0]), 5, r"go on there: other data$"),
        ((learn, validate[1:], RECIPES[0]), 5, r"go on there: other validation data$"),
        ((learn, validate, replace(RECIPES[0], epochs=9)), 5, r"go on there: recipe's epochs 4 instead of 9$"),
    ):
        with pytest.raises(InputError, match=r"training\.pt belongs to another training, .*" + told):
            train(*arguments, seed=seed, state=state)
    assert state.read_bytes() == before


def test_what_is_no_state(tmp_path):
    path = tmp_path / "training.pt"
    whose = identity(*SPLIT, RECIPES[0], seed=0)
    assert TrainingState.load(path, whose) is None
    for content in (b"", b"not torch"):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"training\.pt can't be read as the state of a training: "):
            TrainingState.load(path, whose)
    torch.save({"version": 99, "whose": whose, "content": {}}, path)
    with pytest.raises(InputError, match="of version 99; expected 1"):
        TrainingState.load(path, whose)


def test_a_file_half_written_is_no_state(tmp_path, monkeypatch):
    path = tmp_path / "training.pt"
    whose = identity(*SPLIT, RECIPES[0], seed=0)
    TrainingState(whose, {"epoch": 1}).save(path)

    def die(content, stream):
        stream.write(b"half")
        raise Stop

    monkeypatch.setattr(torch, "save", die)
    with pytest.raises(Stop):
        TrainingState(whose, {"epoch": 2}).save(path)
    assert TrainingState.load(path, whose).content == {"epoch": 1}


def test_names_are_of_what_decides_the_bits():
    here = name_of(identity(*SPLIT, RECIPES[0], seed=0))
    assert here == name_of(identity(*SPLIT, RECIPES[0], seed=0))
    assert here != name_of(identity(*SPLIT, RECIPES[0], seed=1))
    assert here != name_of(identity(*SPLIT, RECIPES[1], seed=0))
