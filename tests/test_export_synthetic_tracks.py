"""Strokes have the shape of human reaching; noise has the promised size; nothing depends on the frame rate."""

import numpy as np

from fervor_export.synthetic.tracks import Track, Wobble, bump, minimum_jerk


def test_a_stroke_starts_and_ends_at_rest() -> None:
    times = np.linspace(-0.5, 1.5, 2001)
    track = Track(np.zeros(1))
    track.move(0.0, 1.0, np.ones(1))
    value = track.at(times)[:, 0]
    speed = np.gradient(value, times)
    assert value[0] == 0.0
    assert value[-1] == 1.0
    assert np.isclose(speed.max(), 1.875, atol=1e-3)  # peak of a minimum-jerk stroke
    assert np.isclose(times[speed.argmax()], 0.5, atol=2e-3)
    assert speed.min() >= -1e-9


def test_strokes_that_overlap_add_up() -> None:
    track = Track(np.zeros(2))
    track.move(0.0, 1.0, np.array([1.0, 0.0]))
    track.move(0.5, 1.0, np.array([1.0, 2.0]))
    assert np.allclose(track.at(np.array([2.0])), [[1.0, 2.0]])


def test_a_swell_leaves_nothing_behind() -> None:
    track = Track(np.full(3, 7.0))
    track.swell(1.0, 0.8, np.array([1.0, -2.0, 3.0]))
    assert np.allclose(track.at(np.array([0.0, 1.4, 3.0])), [[7, 7, 7], [8, 5, 10], [7, 7, 7]])
    assert np.allclose(track.now, 7.0)


def test_a_track_without_strokes_stands_still() -> None:
    assert np.array_equal(Track(np.ones(2)).at(np.zeros(3)), np.ones((3, 2)))


def test_shapes_stay_within_0_and_1() -> None:
    progress = np.linspace(-1.0, 2.0, 301)
    for shape in (minimum_jerk, bump):
        assert shape(progress).min() >= 0.0
        assert shape(progress).max() <= 1.0
    assert bump(np.array([0.0, 0.5, 1.0])).tolist() == [0.0, 1.0, 0.0]


def test_noise_has_unit_size_and_only_its_band() -> None:
    rng, times = np.random.default_rng(0), np.arange(0.0, 200.0, 0.02)
    noise = Wobble.draw(rng, low_hz=1.0, high_hz=4.0, dim=400)
    values = noise.at(times)
    assert 0.85 < values.std() < 1.15
    power = (np.abs(np.fft.rfft(values, axis=0)) ** 2).sum(axis=1)
    hertz = np.fft.rfftfreq(len(times), 0.02)
    assert power[(hertz > 0.9) & (hertz < 4.2)].sum() / power.sum() > 0.99
    assert np.allclose(noise.at(times[::10]), values[::10])
