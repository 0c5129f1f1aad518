"""Edits of motion in a known direction: faster, larger, more abrupt, bent, opened; together "more" of an emotion.

They act on the rotations of motion that exists and know nothing of the generator. Which of them make a body look more
of an emotion is taken from studies of movement: W = Wallbott 1998, M = de Meijer 1989, P = Pollick et al. 2001,
R = Roether et al. 2009, G = Gross et al. 2010 and 2012, C = Crane & Gross 2013, D = Dael et al. 2012, H = Halovic &
Kroos 2018, T = Tracy & Robins 2004, L = Niewiadomski et al. 2014, V = Vlemincx et al. 2010 (sighs).
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter1d

from fervor.rotations import align_hemisphere, conjugate, from_rotvec, mean, multiply, normalise, slerp, to_rotvec
from fervor.skeletons.rig import JOINTS, MIRROR

Array = npt.NDArray[np.float64]

SPINE, CHEST, HEAD, SHOULDER, ELBOW = (JOINTS.index(f"{name}") for name in ("spine", "chest", "head", "l_shoulder",
                                                                            "l_elbow"))  # fmt: skip
ARMS, TRUNK = tuple(range(3, 9)), (SPINE, CHEST, HEAD)
X, Y, Z = np.eye(3)  # left, up, forward: +X bends forward, +Y turns left, +Z lifts a hanging left arm aside


@dataclass(frozen=True, slots=True)
class Source:
    """A recording to cut from."""

    name: str
    times: Array  # [frame] seconds
    local: Array  # [frame, 13, 4]

    def at(self, times: Array) -> Array:
        """Rotations [frame, 13, 4] at `times` [frame]; beyond its ends it is played back to and fro."""
        first, whole = self.times[0], self.times[-1] - self.times[0]
        phase = np.mod(times - first, 2.0 * whole)
        wanted = first + np.minimum(phase, 2.0 * whole - phase)
        after = np.clip(np.searchsorted(self.times, wanted), 1, len(self.times) - 1)
        share = (wanted - self.times[after - 1]) / (self.times[after] - self.times[after - 1])
        return slerp(self.local[after - 1], self.local[after], np.broadcast_to(share[:, None], (len(times), 13)))


@dataclass(frozen=True, slots=True)
class Edit:
    """What is changed; every number is 0 or 1 where nothing is, angles in degrees."""

    tempo: float = 1.0  # x, of everything
    size: float = 1.0  # x, excursions about the mean pose
    abrupt: float = 0.0  # 0..0.8, stop and go: depth of a 1.3 Hz wave in the tempo
    smooth: float = 0.0  # s, deviation of a Gaussian over time
    tremor: float = 0.0  # deviation at 7 to 11 Hz, arms
    laugh: float = 0.0  # shaking of chest and head at 5 Hz
    bounce: float = 0.0  # of spine and knees at 2 Hz
    head: float = 0.0  # down
    aside: float = 0.0  # head turned
    bent: float = 0.0  # spine and chest forward
    lean: float = 0.0  # spine forward
    open: float = 0.0  # upper arms away from the trunk
    raised: float = 0.0  # upper arms forward
    flexed: float = 0.0  # elbows
    startle: float = 0.0  # back and arms up within 0.25 s in the middle of the clip
    sigh: float = 0.0  # chest out within 1 s, then letting go

    def scaled(self, strength: float) -> "Edit":
        """This edit at a strength: 0 is none, 1 is whole, negative is its opposite. Events have no opposite."""
        events = ("startle", "sigh", "laugh", "tremor", "bounce", "abrupt", "smooth")
        values = {}
        for name in self.__slots__:
            value = getattr(self, name)
            if name in ("tempo", "size"):
                values[name] = value**strength
            else:
                values[name] = value * (max(strength, 0.0) if name in events else strength)
        return Edit(**values)


MORE: dict[str, Edit] = {
    "joy": Edit(tempo=1.25, size=1.3, head=-10, bent=-8, open=12, raised=6, bounce=2.5),  # W M P G R
    "amusement": Edit(tempo=1.1, size=1.1, laugh=2.2, bent=5, head=-5),  # L
    "anger": Edit(tempo=1.45, size=1.3, abrupt=0.45, lean=7, head=4, open=8, flexed=15),  # W M P R H D
    "disgust": Edit(size=0.85, lean=-8, aside=28, head=4, open=-5),  # W M D
    "fear": Edit(size=0.75, tremor=1.5, lean=-9, bent=8, open=-8, raised=18, flexed=35, tempo=1.15),  # W M R D H
    "pride": Edit(tempo=0.9, bent=-14, head=-12, open=16, smooth=0.06),  # T
    "relief": Edit(tempo=0.75, size=0.85, smooth=0.12, sigh=12),  # D V
    "sadness": Edit(tempo=0.65, size=0.65, smooth=0.1, head=20, bent=16, open=-6),  # W M P R G C
    "shame": Edit(tempo=0.85, size=0.65, head=22, aside=18, bent=12, open=-10),  # W T
    "surprise": Edit(tempo=1.1, startle=14, head=-7),  # D
}
"""Emotion → what makes a body look more of it."""

Frames = Callable[[Array], Array]


@dataclass(frozen=True, slots=True)
class Cut:
    """A piece of a recording, and how its body moved before anything was edited."""

    source: Source
    middle: float  # s
    seconds: float
    rate_hz: float = 30.0
    side: float = 1.0  # 1 or -1: to which side a head turns
    phases: Array = field(default_factory=lambda: np.zeros(3))  # of waves, radians

    def times(self) -> Array:
        """Seconds from the cut's begin [frame]."""
        return np.arange(round(self.seconds * self.rate_hz)) / self.rate_hz


def edited(cut: Cut, edit: Edit) -> Array:
    """A cut's rotations [frame, 13, 4] with an edit."""
    times = cut.times()
    wave = 2.0 * np.pi * 1.3
    warp = edit.abrupt / wave * (np.sin(wave * times + cut.phases[0]) - np.sin(cut.phases[0]))
    local = cut.source.at(cut.middle + edit.tempo * (times - cut.seconds / 2 + warp))
    local = _sized(local, edit.size)
    if edit.smooth:
        local = _smoothed(local, edit.smooth * cut.rate_hz)
    for joint, turn in _turns(cut, edit, times):
        local[:, joint] = multiply(from_rotvec(np.radians(turn)), local[:, joint])
    return _trembling(local, edit.tremor, times, cut) if edit.tremor else local


def _sized(local: Array, factor: float) -> Array:
    """Excursions about each joint's mean rotation, times `factor`."""
    middle = np.stack([mean(local[:, joint]) for joint in range(local.shape[1])])
    away = to_rotvec(multiply(conjugate(middle)[None].repeat(len(local), 0), local))
    return multiply(middle[None].repeat(len(local), 0), from_rotvec(factor * away))


def _smoothed(local: Array, frames: float) -> Array:
    aligned = local.copy()
    for frame in range(1, len(local)):
        aligned[frame] = align_hemisphere(local[frame], aligned[frame - 1])
    return normalise(gaussian_filter1d(aligned, frames, axis=0, mode="nearest"))


def _turns(cut: Cut, edit: Edit, times: Array) -> list[tuple[int, Array]]:
    """Joint and rotation vectors [frame, 3] in degrees, in the axes of the segment above."""
    still = np.ones_like(times)
    started = edit.startle * _started(times - cut.seconds / 2)
    sighed = edit.sigh * _sighed(times - cut.seconds / 2 + 0.8)
    laughing = edit.laugh * np.sin(2.0 * np.pi * 5.0 * times + cut.phases[1])
    bounce = edit.bounce * np.sin(2.0 * np.pi * 2.0 * times + cut.phases[2])
    spine = (edit.lean + 0.4 * edit.bent) * still - 0.6 * started + 0.3 * sighed + 0.6 * laughing + 0.5 * bounce
    chest = 0.6 * edit.bent * still - 0.4 * started + 0.7 * sighed + laughing
    head = (edit.head - 0.3 * edit.lean) * still - 0.5 * started + 0.6 * sighed + laughing - 0.4 * bounce
    turns = [(SPINE, _about(X, spine)), (CHEST, _about(X, chest))]
    turns.append((HEAD, _about(X, head) + _about(Y, cut.side * edit.aside * still)))
    out, fore = edit.open * still + 1.2 * started, edit.raised * still + 1.8 * started
    flexed = edit.flexed * still + 2.5 * started
    for side, shoulder, elbow in ((1.0, SHOULDER, ELBOW), (-1.0, MIRROR[SHOULDER], MIRROR[ELBOW])):
        turns += [(shoulder, _about(Z, side * out) - _about(X, fore)), (elbow, -_about(X, flexed))]
    for knee in (JOINTS.index("l_knee"), JOINTS.index("r_knee")):
        turns.append((knee, _about(X, 1.5 * bounce)))
    return turns


def _about(axis: Array, degrees: Array) -> Array:
    return degrees[:, None] * axis


def _started(age: Array) -> Array:
    """0 before, 1 a quarter of a second after the event, then letting go."""
    rise = np.clip(age / 0.25, 0.0, 1.0)
    return (3 * rise**2 - 2 * rise**3) * np.exp(-np.maximum(age - 0.8, 0.0) / 1.5)


def _sighed(age: Array) -> Array:
    """Chest out for a second (-0.7), then sunk (+1), slowly gone."""
    inhale = np.sin(np.pi * np.clip(age / 1.2, 0.0, 1.0))
    exhale = np.clip((age - 1.0) / 1.0, 0.0, 1.0)
    return -0.7 * inhale + (3 * exhale**2 - 2 * exhale**3) * np.exp(-np.maximum(age - 2.5, 0.0) / 2.0)


def _trembling(local: Array, degrees: float, times: Array, cut: Cut) -> Array:
    rng = np.random.default_rng(round(1000 * cut.middle))
    waves, phases = rng.uniform(7.0, 11.0, (4, len(ARMS), 3)), rng.uniform(0.0, 2.0 * np.pi, (4, len(ARMS), 3))
    noise = np.sin(2.0 * np.pi * waves * times[:, None, None, None] + phases).sum(1) / np.sqrt(2.0)
    shaken = local.copy()
    shaken[:, ARMS] = multiply(local[:, ARMS], from_rotvec(np.radians(degrees / np.sqrt(3.0)) * noise))
    return shaken
