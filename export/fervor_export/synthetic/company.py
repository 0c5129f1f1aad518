"""What trunk, head and feet do of themselves and along with the arms: the part of a script that is not gesture."""

import numpy as np

from fervor_export.synthetic.gestures import Gesture
from fervor_export.synthetic.scene import Scene
from fervor_export.synthetic.script import Laugh, Legs, Script, Torso
from fervor_export.synthetic.tracks import Array

SHAKE = {"disgust": 0.45, "sadness": 0.35, "shame": 0.2, "anger": 0.25, "relief": 0.15, "fear": 0.15, "amusement": 0.2}
"""Emotion → how many of its head movements are shakes when strong."""

Style = dict[str, float]
"""Channel values by name at one time."""


def turn(
    *,
    spine: tuple[float, float, float] = (0.0, 0.0, 0.0),
    thorax: tuple[float, float, float] = (0.0, 0.0, 0.0),
    head: tuple[float, float, float] = (0.0, 0.0, 0.0),
    shrug: float = 0.0,
) -> Array:
    """A change of the trunk [Torso.DIM]: pitch, yaw, roll in degrees, shoulders in metres."""
    step = np.zeros(Torso.DIM)
    step[Torso.SPINE], step[Torso.THORAX], step[Torso.HEAD], step[Torso.SHRUG] = spine, thorax, head, shrug
    return step


class Company:
    """Writes the trunk's and the legs' part of a script: what keeps the arms company."""

    def __init__(self, rng: np.random.Generator, script: Script) -> None:
        self.rng, self.script = rng, script
        self.trunk, self.manner = script.trunk, script.manner
        self.settled = np.zeros(Torso.DIM)  # by the last shift of weight

    @property
    def scene(self) -> Scene:
        """The take's scene."""
        return self.script.scene

    def noise(self, *size: float) -> tuple[float, float, float]:
        """Three normal numbers with these standard deviations."""
        pitch, yaw, roll = self.rng.normal(0.0, size)
        return float(pitch), float(yaw), float(roll)

    def nodding(self, style: Style) -> float:
        """How much this head moves, against an average one."""
        return style["nod"] * self.script.person.nod

    # Along with a gesture

    def accompany(self, gesture: Gesture, time: float, style: Style, lead: float) -> None:
        """Trunk, head and shoulders take part in a gesture until it is over; `lead` 1 for the left hand, -1, 0 both."""
        part, size, way = style["trunk"], style["reach"], self.script.way
        highest = max((pose.up for pose in gesture.poses if pose.anchor == "chest"), default=-0.3) + 0.3
        pitch = gesture.trunk * (0.4 + part)
        if not gesture.touch:
            pitch -= 12.0 * max(highest, 0.0) * part * size
        down, aside, tilt = gesture.head
        step = turn(
            spine=(0.55 * pitch, lead * 11.0 * part * size, lead * 4.0 * part),
            thorax=(0.45 * pitch, lead * 6.0 * part * size, lead * 2.0 * part),
            head=(down - 0.3 * pitch, way * aside - lead * 5.0 * part, way * tilt),
            shrug=gesture.shrug,
        )
        step[Torso.HEAD] += self.rng.normal(0.0, 4.0, 3) * self.nodding(style)
        self.trunk.push(time, 0.55 / (style["tempo"] * gesture.pace) ** 0.7, step)

    def beat(self, time: float, duration: float, style: Style) -> None:
        """Head and trunk mark a stroke."""
        force = self.nodding(style) * float(self.rng.uniform(0.0, 1.0))
        part = style["trunk"] * style["reach"] ** 0.5
        step = turn(
            spine=self.noise(0.0, 4.0 * part, 1.5 * part),
            thorax=self.noise(0.0, 2.0 * part, 0.0),
            head=self.noise(0.0, 4.5 * force, 2.5 * force),
        ) + force * turn(spine=(4.5 * part, 0.0, 0.0), thorax=(1.5 * part, 0.0, 0.0), head=(6.5, 0.0, 0.0))
        self.trunk.swell(time + 0.3 * duration, max(duration, 0.25) * 1.3, step)

    def relax(self, time: float, pace: float, before: Array) -> None:
        """Go back to how the trunk [Torso.DIM] was before a gesture."""
        self.trunk.push(time, 0.8 / pace, before - self.trunk.now)

    # Events

    def event(self, time: float) -> None:
        """The moment at which the emotion begins: relief sighs, all others start back."""
        size = self.manner.at(time + 0.3)["start"]
        if self.manner.emotion == "relief":
            self.sigh(time, size)
        else:
            self.startle(time, size)

    def startle(self, time: float, size: float) -> None:
        """Start back: head and shoulders first, within a fifth of a second, then let go (Landis & Hunt 1939)."""
        step = size * turn(
            spine=(-11.0, 0.0, 0.0), thorax=(-5.0, 0.0, 0.0), head=self.noise(0.0, 6.0, 0.0), shrug=0.035
        )
        step[Torso.HEAD.start] -= 9.0 * size
        self.trunk.push(time, float(self.rng.uniform(0.16, 0.3)), step)
        self.trunk.push(time + float(self.rng.uniform(0.4, 1.4)), float(self.rng.uniform(0.8, 2.0)), -0.8 * step)

    def sigh(self, time: float, size: float) -> None:
        """A deep breath, and letting it go: shoulders, chest, head (Vlemincx et al. 2010: sighs of relief)."""
        rise = size * turn(spine=(-4.0, 0, 0), thorax=(-7.0, 0, 0), head=(-7.0, 0, 0), shrug=0.03)
        fall = size * turn(spine=(9.0, 0, 0), thorax=(12.0, 0, 0), head=(9.0, 0, 0), shrug=-0.04)
        inhale, exhale = float(self.rng.uniform(0.6, 1.1)), float(self.rng.uniform(0.8, 1.6))
        self.trunk.push(time, inhale, rise)
        self.trunk.push(time + inhale + 0.1, exhale, fall)
        self.trunk.push(time + inhale + exhale + float(self.rng.uniform(0.5, 2.5)), 2.0, -(rise + fall))

    # All the time

    def live(self) -> None:
        """Everything that goes on beside the gestures."""
        self.move_head()
        self.shift_weight()
        self.laugh()

    def move_head(self) -> None:
        """Nods, shakes and glances of a living head."""
        time = -float(self.rng.uniform(0.0, 3.0))
        while time < self.script.seconds:
            style, kind = self.manner.at(time), self.rng.random()
            tempo = style["tempo"] ** 0.6 * self.script.person.tempo
            if kind < 0.35:
                time = self.nod(time, self.nodding(style), 0.42 / tempo)
            elif kind < 0.35 + SHAKE.get(self.manner.emotion, 0.1) * style["emblem"]:
                time = self.shake(time, 0.38 / tempo)
            else:
                wide = 1.0 + (self.manner.emotion == "fear") * style["emblem"]  # looking about
                time = self.glance(time, wide, float(self.rng.uniform(0.25, 0.5)) / tempo / wide)
            time += float(self.rng.exponential(1.6 / self.nodding(style)))

    def nod(self, time: float, size: float, duration: float) -> float:
        """One to three nods; returns when they are over."""
        for _ in range(int(self.rng.integers(1, 4))):
            self.trunk.swell(time, duration, turn(head=(float(self.rng.uniform(4.0, 12.0)) * size, 0.0, 0.0)))
            time += duration
        return time

    def shake(self, time: float, duration: float) -> float:
        """Shakes of the head; returns when they are over."""
        for sign in (1.0, -1.0) * int(self.rng.integers(1, 4)):
            self.trunk.swell(time, duration, turn(head=(0.0, sign * float(self.rng.uniform(8.0, 20.0)), 0.0)))
            time += duration
        return time

    def glance(self, time: float, wide: float, duration: float) -> float:
        """A look to somewhere else, and back; returns when it turns back."""
        step = turn(head=self.noise(6.0, 15.0 * wide, 5.0))
        held = float(self.rng.uniform(0.3, 1.8))
        self.trunk.push(time, duration, step)
        self.trunk.push(time + duration + held, duration * 1.2, -step)
        return time + duration + held

    def shift_weight(self) -> None:
        """Changes of posture every few seconds: the trunk settles anew, a standing body makes a small step."""
        rng, time = self.rng, -float(self.rng.uniform(0.0, 4.0))
        stands, feet = self.scene.posture == "stand", self.scene.feet
        while time < self.script.seconds:
            style = self.manner.at(time)
            size = (style["sway"] * self.script.person.unrest) ** 0.5
            step = size * turn(spine=self.noise(3.5, 4.0, 3.0), thorax=self.noise(1.5, 2.0, 1.5))
            duration = float(rng.uniform(0.5, 1.4)) / style["tempo"] ** 0.5
            self.trunk.push(time, duration, step - 0.5 * self.settled)
            self.settled = step + 0.5 * self.settled
            if rng.random() < (min(0.5 * feet, 0.9) if stands else 0.15):
                self.step_aside(time, duration, size * (min(feet, 2.0) if stands else 0.3))
            time += float(rng.exponential(3.2)) / size + 0.3

    def step_aside(self, time: float, duration: float, size: float) -> None:
        """Lift one foot and set it down, and carry the weight over."""
        leg, lift, legs = int(self.rng.integers(2)), float(self.rng.uniform(8.0, 26.0)) * size, self.script.legs
        up = np.zeros(Legs.DIM)
        up[leg], up[2 + leg] = lift, 1.8 * lift
        legs.swell(time, min(duration, 0.8), up)
        shifted = self.rng.normal(0.0, 2.5, Legs.DIM) * size * np.array([1.0, 1.0, 0.0, 0.0])
        legs.push(time, duration, shifted - 0.5 * legs.now)

    def laugh(self) -> None:
        """Bouts of laughter with rests between; the trunk folds forward or falls back (Griffin et al. 2015)."""
        rng, time = self.rng, -float(self.rng.uniform(0.0, 3.0))
        while time < self.script.seconds:
            share = self.manner.at(time)["laugh"]
            if share < 0.04:
                time += 1.0
                continue
            duration = float(rng.uniform(0.7, 1.6) + 2.0 * share * rng.random())
            self.script.laughs.append(Laugh(time, duration, 0.35 + 0.75 * share, float(rng.uniform(4.2, 5.6))))
            fold = float(rng.normal(6.0, 9.0))
            step = turn(spine=self.noise(0.0, 4.0, 4.0), head=self.noise(9.0, 5.0, 4.0))
            step = share * (step + turn(spine=(0.6 * fold, 0, 0), thorax=(0.4 * fold, 0, 0), head=(-4.0, 0, 0)))
            self.trunk.push(time, 0.5, step)
            self.trunk.push(time + duration, 0.7, -step)
            time += duration * (1.0 + float(rng.uniform(0.5, 1.5)) * (1.0 - share) / share)
