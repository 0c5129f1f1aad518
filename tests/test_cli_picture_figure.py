"""Pictures as files: their proportions, what is in them, and recordings of every odd kind."""

import io
import re
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from matplotlib.image import imread

from fervor.cli.picture import figure
from fervor.cli.picture.chart import MOST_POINTS, _points, thinned
from fervor.cli.picture.palette import LIGHT, between
from fervor.cli.picture.strip import _turned_by
from fervor.skeletons.rig import JOINTS
from pictures import estimate, trace, waving

RISING = [estimate(n, n / 299) for n in range(300)]


def shown(picture: np.ndarray, colour: str) -> np.ndarray:
    """The pixels of a colour, as columns in [0, 1]."""
    wanted = np.asarray([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255
    there = np.abs(picture[..., :3] - wanted).max(-1) < 0.01
    return np.flatnonzero(there.any(0)) / picture.shape[1]


def test_a_png_shows_bodies_in_the_colour_of_their_intensity():
    picture = imread(io.BytesIO(figure.image(trace(RISING), "png")))
    assert picture.shape[1] == round(figure.WIDTH * figure.DOTS_PER_INCH)
    width = figure.WIDTH - figure.LEFT - figure.RIGHT
    for number in (0, figure.BODIES - 1):
        share = (number + 0.5) / figure.BODIES
        middle = (figure.LEFT + width * share) / figure.WIDTH
        nearest = min(RISING, key=lambda one: abs(one.t - share * RISING[-1].t))
        columns = shown(picture, between(LIGHT.weak, LIGHT.strong, nearest.intensity))
        assert np.abs(columns - middle).min() < 0.01
        assert np.abs(columns - middle).max() < 0.06


def test_bodies_keep_their_proportions():
    """A metre up is as long on the page as a metre to the side, whatever the duration."""
    for frames in (30, 3000):
        drawn = figure.draw(trace([estimate(n) for n in range(frames)]))
        drawn.canvas.draw()
        strip = drawn.axes[0]
        head = strip.patches[0].get_window_extent()
        assert head.width == pytest.approx(head.height, rel=0.02)


def test_the_same_numbers_give_the_same_file():
    for kind in ("png", "svg"):
        assert figure.image(trace(RISING), kind) == figure.image(trace(RISING), kind)


def test_an_svg_is_well_formed_and_says_nothing_of_when_and_where():
    drawn = figure.image(trace(RISING), "svg").decode()
    assert ET.fromstring(drawn).tag.endswith("svg")
    assert "<dc:date>" not in drawn


def test_dark_and_light_differ_only_where_they_may():
    """Colours of the paper's side must be told apart from all others, for a page replaces them by name."""
    values = [getattr(LIGHT, name) for name in LIGHT.__slots__]
    assert len(set(values)) == len(values)
    assert all(re.fullmatch("#[0-9a-f]{6}", value) for value in values)


@pytest.mark.parametrize(
    "odd",
    [
        [estimate(0)],
        [estimate(n, None) for n in range(30)],
        [estimate(n, None if n < 15 else 0.5) for n in range(30)],
        [estimate(n, n % 2) for n in range(0, 600, 60)],
        [estimate(n, emotion="joy" if n % 2 else "unknown") for n in range(90)],
        [estimate(n, status="insufficient", flags=("jump", "held")) for n in range(30)],
        [estimate(n, t=1e9 + n / 30) for n in range(90)],
        [estimate(n, t=-5.0 + n / 30) for n in range(90)],
        [estimate(n, t=float(n), intensity=0.5) for n in range(300)],
    ],
    ids=["one", "no pose", "late pose", "gaps only", "labels", "flags", "epoch", "negative", "slow"],
)
def test_odd_recordings_are_drawn(odd):
    assert figure.image(trace(odd), "png").startswith(b"\x89PNG")


@pytest.mark.parametrize("name", ["$joy_{", "a$b$c.bvh", "喜び.bvh", "x" * 300, "", "a\nb"])
def test_a_name_is_only_a_name(name: str):
    assert figure.image(trace(RISING[:9], name=name), "png").startswith(b"\x89PNG")


def test_a_body_that_was_never_seen_is_drawn_dotted():
    poses = waving(30)
    poses[:, JOINTS.index("l_elbow")] = np.nan
    drawn = figure.draw(trace([estimate(n) for n in range(30)], poses=poses))
    styles = {line.get_linestyle() for line in drawn.axes[0].lines}
    assert len(styles) == 2
    assert {len(drawn.axes[0].lines) % figure.BODIES} == {0}


@pytest.mark.parametrize(
    ("point", "joint"),
    [("l_elbow", "l_shoulder"), ("r_wrist", "r_elbow"), ("head", "head"), ("spine_mid", "spine"), ("r_knee", "r_hip")],
)
def test_a_limb_is_unseen_where_the_joint_above_it_is(point: str, joint: str):
    assert _turned_by(point) == (JOINTS.index(joint),)


@pytest.mark.parametrize(("seconds", "first"), [(36, ["0", "5"]), (612, ["0:00", "1:00"]), (8000, ["0:00", "30:00"])])
def test_time_is_counted_as_people_count(seconds: int, first: list[str]):
    drawn = figure.draw(trace([estimate(0), estimate(1, t=float(seconds))]))
    drawn.canvas.draw()
    low, high = drawn.axes[-1].get_xlim()
    ticks = zip(drawn.axes[-1].get_xticks(), drawn.axes[-1].get_xticklabels(), strict=True)
    labels = [label.get_text() for at, label in ticks if low <= at <= high]
    assert labels[:2] == first
    assert len(labels) <= 13


def test_many_points_are_thinned_to_their_extremes():
    values = [None if n % 97 == 0 else float(np.sin(n)) for n in range(50_000)]
    values[31_415], values[27_182] = 2.0, -2.0
    kept = thinned(values, MOST_POINTS)
    assert len(kept) <= MOST_POINTS
    assert {0, 31_415, 27_182, 49_999} <= set(kept)
    assert kept == sorted(kept)


def test_a_thinned_curve_still_ends_at_its_gaps():
    hole = [estimate(n, t=n / 120.0, intensity=0.5) for n in range(9000) if not 4001 <= n < 4501]
    drawn = _points(hole)
    at = drawn.index(None)
    assert (drawn[0], drawn[at - 1], drawn[at + 1], drawn[-1]) == (hole[0], hole[4000], hole[4001], hole[-1])
    assert len(drawn) <= MOST_POINTS + 5


def test_few_points_are_all_kept():
    assert thinned([0.1] * 7, 8) == list(range(7))
