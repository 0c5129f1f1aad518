"""Results are kept by what they follow from."""

import numpy as np
import pytest

from fervor_export.evaluation.remembered import remembered


def test_the_same_causes_are_asked_once(tmp_path):
    values = np.random.default_rng(0).random(5)
    made = remembered(tmp_path / "kept", ("a", values), lambda: {"said": values / 3})
    again = remembered(tmp_path / "kept", ("a", values.copy()), lambda: pytest.fail("made again"))
    np.testing.assert_array_equal(made["said"], again["said"])
    for causes in (("b", values), ("a", values + 1e-12)):
        other = remembered(tmp_path / "kept", causes, lambda: {"said": np.asarray([np.nan, 1.0])})
        assert len(other["said"]) == 2
    read = remembered(tmp_path / "kept", ("b", values), lambda: pytest.fail("made again"))
    assert np.isnan(read["said"][0])


def test_nothing_is_kept_without_a_folder():
    for value in (1.0, 2.0):
        assert remembered(None, (), lambda value=value: {"said": np.asarray(value)})["said"] == value


def test_what_can_not_be_read_is_made_anew(tmp_path):
    remembered(tmp_path, (1,), lambda: {"said": np.ones(2)})
    (path,) = tmp_path.iterdir()
    path.write_text('{"said": [1.0, ')
    assert remembered(tmp_path, (1,), lambda: {"said": np.zeros(2)})["said"].tolist() == [0.0, 0.0]
