"""Skeletons as JSON."""

import json

import numpy as np
import pytest
from pydantic import ValidationError

from fervor.errors import InputError
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.skeletons.catalog import SKELETONS, skeleton


@pytest.mark.parametrize("name", [name for name, known in SKELETONS.items() if not known.needs_local])
def test_every_skeleton_of_the_catalogue_survives_json(name):
    known = skeleton(name)
    again = SkeletonSpec.model_validate_json(SkeletonSpec.of(known).model_dump_json()).to_skeleton()
    assert (again.name, again.joints, again.parents, again.drives) == (
        known.name,
        known.joints,
        known.parents,
        known.drives,
    )
    assert (again.axes, again.quaternion, again.noisy, again.sees) == (
        known.axes,
        known.quaternion,
        known.noisy,
        known.sees,
    )
    driven = [at for at, joint in enumerate(known.drives) if joint is not None]
    assert np.allclose(again.bind[driven], known.bind[driven], atol=1e-15)


def test_the_rig_goes_by_name():
    with pytest.raises(InputError, match="'c13' has no pelvis joint"):
        SkeletonSpec.of(skeleton("c13"))


GOOD = {"name": "x", "joints": ["a", "b"], "parents": [-1, 0], "segments": {"pelvis": "a", "thorax": "b"}}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"parents": [-1]}, "2 joints have 1 parents"),
        ({"parents": [1, 0]}, "never reach a root"),
        ({"parents": [-1, 7]}, "never reach a root"),
        ({"joints": ["a", "a"]}, "named twice"),
        ({"segments": {"tail": "a"}}, "maps 'tail' to 'a'"),
        ({"segments": {"pelvis": "z"}}, "maps 'pelvis' to 'z'"),
        ({"bind": {"pelvis": [0, 0, 0, 9]}}, "bind of 'pelvis'"),
        ({"bones": 3}, "Extra inputs"),
    ],
)
def test_what_does_not_fit_together_is_told(changes, told):
    assert SkeletonSpec.model_validate_json(json.dumps(GOOD)).to_skeleton().joints == ("a", "b")
    with pytest.raises(ValidationError, match=told):
        SkeletonSpec.model_validate_json(json.dumps(GOOD | changes))
