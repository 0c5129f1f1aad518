"""Handcrafted features of the paper's baseline: speeds, accelerations, joint angles, body expansion.

The paper names these four kinds and no more (section IV-C). Here they are computed on positions of a standard body at
30 Hz, smoothed by a Savitzky-Golay filter (7 frames, degree 2); each series over time becomes its mean, standard
deviation, maximum and 10th, 50th and 90th percentile. Formulas: docs, "Handcrafted features".
"""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from scipy.signal import savgol_filter

from fervor.skeletons.standard_body import MIDHIP, points
from fervor_export.clip import RATE_HZ, Clip

Floats = npt.NDArray[np.float64]

WINDOW, DEGREE = 7, 2
"""Frames and degree of the smoothing filter; shorter clips have a shorter window."""

TRACKED = (
    "head", "midshoulder", "l_shoulder", "r_shoulder", "l_elbow", "r_elbow", "l_wrist", "r_wrist", "l_knee", "r_knee",
    "l_ankle", "r_ankle",
)  # fmt: skip
"""Points with a speed and an acceleration; the hips never move on a body without a root."""

BODY = (*TRACKED, "l_hip", "r_hip")

MASS_KG: Mapping[str, float] = {
    "head": 5.7, "midshoulder": 15.1, "l_elbow": 2.0, "r_elbow": 2.0, "l_wrist": 1.5, "r_wrist": 1.5, "l_knee": 7.0,
    "r_knee": 7.0, "l_ankle": 4.3, "r_ankle": 4.3,
}  # fmt: skip
"""Of the segments that end at a point, for a body of 70 kg (Winter 2009, table 4.1)."""

_CORNERS = {
    "elbow": ("shoulder", "elbow", "wrist"),
    "shoulder": ("elbow", "shoulder", "hip"),
    "knee": ("hip", "knee", "ankle"),
    "hip": ("shoulder", "hip", "knee"),
}

ANGLES: Mapping[str, tuple[str, str, str]] = {
    "neck": ("head", "midshoulder", MIDHIP),
    **{
        f"{side}_{name}": (f"{side}_{a}", f"{side}_{b}", f"{side}_{c}")
        for side in "lr"
        for name, (a, b, c) in _CORNERS.items()
    },
}
"""Angles at the middle one of three points."""

AGGREGATES = ("mean", "sd", "max", "p10", "p50", "p90")


def features(clip: Clip, *, scale: float = 1.0) -> dict[str, float]:
    """All features of a clip by name.

    Args:
        clip: at 30 Hz.
        scale: of the standard body's bones; angles don't depend on it, the rest is in metres.
    """
    at = {name: _smooth(place) for name, place in points(clip.rotations, scale=scale).items()}
    speed = {name: _speed(at[name]) for name in TRACKED}
    series = {f"speed_{name}": values for name, values in speed.items()}
    series |= {f"acceleration_{name}": _acceleration(at[name]) for name in TRACKED}
    series |= {f"angle_{name}": values for name, values in _angles(at).items()}
    series |= _expansion(at)
    series["kinetic_energy"] = 0.5 * sum(
        (mass * speed[name] ** 2 for name, mass in MASS_KG.items()), start=np.zeros(clip.frames)
    )
    table = {
        f"{name}_{how}": value
        for name, values in series.items()
        for how, value in zip(AGGREGATES, _aggregate(values), strict=True)
    }
    return table | _whole(at)


def matrix(clips: Sequence[Clip], *, scale: float = 1.0) -> Floats:
    """Features [clip, feature] in the order of `features`."""
    return np.array([list(features(clip, scale=scale).values()) for clip in clips])


def _aggregate(values: Floats) -> list[float]:
    return [float(values.mean()), float(values.std()), float(values.max()), *np.percentile(values, (10, 50, 90))]


def _smooth(place: Floats) -> Floats:
    """Positions [frame, 3] without jitter."""
    window = min(WINDOW, len(place) - (len(place) + 1) % 2)
    if window <= DEGREE:
        return place
    smoothed: Floats = savgol_filter(place, window, DEGREE, axis=0)
    return smoothed


def _speed(place: Floats) -> Floats:
    """|p(t+1) - p(t-1)| / 2dt [frame] in m/s; one-sided at the ends."""
    if len(place) < 2:
        return np.zeros(len(place))
    speed: Floats = np.linalg.norm(np.gradient(place, 1.0 / RATE_HZ, axis=0), axis=-1)
    return speed


def _acceleration(place: Floats) -> Floats:
    """|p(t+1) - 2p(t) + p(t-1)| / dt² [frame] in m/s²; the ends repeat their neighbours."""
    if len(place) < 3:
        return np.zeros(len(place))
    inside = np.linalg.norm(place[2:] - 2.0 * place[1:-1] + place[:-2], axis=-1) * RATE_HZ**2
    return np.pad(inside, 1, mode="edge")


def _angles(at: Mapping[str, Floats]) -> dict[str, Floats]:
    """Angles [frame] in radians."""
    turned = {name: _between(at[a] - at[b], at[c] - at[b]) for name, (a, b, c) in ANGLES.items()}
    turned["twist"] = _between(at["l_shoulder"] - at["r_shoulder"], at["l_hip"] - at["r_hip"])
    turned["lean"] = _between(at["midshoulder"] - at[MIDHIP], np.array([0.0, 1.0, 0.0]))
    return turned


def _between(a: Floats, b: Floats) -> Floats:
    """Angles [frame] between vectors [frame, 3], exact for small ones too."""
    angle: Floats = np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1))
    return angle


def _expansion(at: Mapping[str, Floats]) -> dict[str, Floats]:
    """How much room the body takes: distances in m, area in m², volume in m³, each [frame]."""
    body = np.stack([at[name] for name in BODY], axis=1)  # [frame, point, 3]
    left, right = at["l_wrist"], at["r_wrist"]
    sides = np.cross(left - at["midshoulder"], right - at["midshoulder"])
    distance = {f"{a}_to_{b}": at[a] - at[b] for a in ("l_wrist", "r_wrist") for b in ("head", MIDHIP)}
    distance["l_wrist_to_r_wrist"] = left - right
    return {
        "volume": np.ptp(body, axis=1).prod(-1),
        "contraction": np.linalg.norm(body - body.mean(1, keepdims=True), axis=-1).mean(-1),
        "area": 0.5 * np.linalg.norm(sides, axis=-1),
        **{name: np.linalg.norm(way, axis=-1) for name, way in distance.items()},
    }


def _whole(at: Mapping[str, Floats]) -> dict[str, float]:
    """Features of the clip as a whole (after Piana et al., arXiv 1402.5047)."""
    whole = {}
    for name in ("l_wrist", "r_wrist"):
        steps = np.linalg.norm(np.diff(at[name], axis=0), axis=-1)
        path = float(steps.sum())
        whole[f"directness_{name}"] = float(np.linalg.norm(at[name][-1] - at[name][0])) / path if path > 1e-6 else 0.0
    arms = [np.linalg.norm(np.diff(at[f"{side}_wrist"], axis=0), axis=-1).sum() for side in "lr"]
    whole["symmetry"] = abs(_reach(at, "l") - _reach(at, "r"))
    whole["handedness"] = float(abs(arms[0] - arms[1]) / max(arms[0] + arms[1], 1e-6))
    return whole


def _reach(at: Mapping[str, Floats], side: str) -> float:
    """Mean distance of an arm's points from the middle plane, m."""
    return float(np.mean([np.abs(at[f"{side}_{name}"][:, 0]) for name in ("shoulder", "elbow", "wrist")]))
