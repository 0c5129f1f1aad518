"""Who does what when: draws the gestures of a take, one after the other.

A gesture is prepared, stroked, held, and taken back unless the next follows at once (Kendon 2004). Durations grow with
distance as in aimed movements (Fitts 1954): a conversational stroke of 0.3 m takes 0.4 s. Emotion changes which
gestures are made, how large, how high, how fast, how abruptly, and how long they are held.
"""

import numpy as np

from fervor_export.synthetic.arm import SHOULDER
from fervor_export.synthetic.company import Company, Style
from fervor_export.synthetic.gestures import GESTURES, Gesture, Pose
from fervor_export.synthetic.manner import Manner
from fervor_export.synthetic.person import Person
from fervor_export.synthetic.repertoire import CONVERSATION, MOOD_OF_REST, REPERTOIRE, REST, RESTING
from fervor_export.synthetic.scene import EMBLEM, RATE, Scene, choose
from fervor_export.synthetic.script import Hand, Legs, Script, Torso, Unrest, around, place
from fervor_export.synthetic.tracks import Array, Track

CENTRE = np.array([0.22, -0.32, 0.26])
"""Where gestures grow from: before the belly, on the hand's side."""

ORIGIN = np.array([SHOULDER, 0.0, 0.0])


class Director:
    """Writes one script; `events` are the seconds at which the emotion visibly begins."""

    def __init__(
        self,
        rng: np.random.Generator,
        person: Person,
        scene: Scene,
        manner: Manner,
        *,
        seconds: float,
        events: tuple[float, ...] = (),
    ) -> None:
        self.rng, self.person, self.scene, self.manner = rng, person, scene, manner
        self.rest = self.rest_pose(manner.at(0.0)["emblem"])  # [Hand.DIM] where the hands lie between gestures
        self.script = Script(
            person=person,
            scene=scene,
            manner=manner,
            seconds=seconds,
            hands=(Track(self.rest), Track(self.rest)),
            trunk=Track(np.zeros(Torso.DIM)),
            legs=Track(np.zeros(Legs.DIM)),
            unrest=Unrest.draw(rng, person),
            way=float(rng.choice((-1.0, 1.0))),
            events=tuple(sorted(events)),
        )
        self.company = Company(rng, self.script)

    def write(self) -> Script:
        """The whole plan."""
        for event in self.script.events:
            self.company.event(event)
        begun = self.rng.random() < 0.75  # else the take begins at rest
        time = -float(self.rng.uniform(0.0, 5.0)) if begun else float(self.rng.uniform(0.1, 1.0))
        waiting = list(self.script.events)
        while time < self.script.seconds:
            urgent = bool(waiting) and time >= waiting[0] - 0.25
            if urgent:
                time = max(time, waiting.pop(0) + 0.03)
            time = self.next_gesture(time, urgent=urgent)
            if waiting:
                time = min(time, waiting[0])  # the event cuts off whatever goes on
        self.company.live()
        return self.script

    def rest_pose(self, intensity: float) -> Array:
        """Where the hands lie [Hand.DIM], by posture and mood."""
        mood = MOOD_OF_REST.get(self.manner.emotion, {})
        usual = RESTING[self.scene.posture]
        name = choose(self.rng, {name: often * mood.get(name, 1.0) ** intensity for name, often in usual.items()})
        return place(REST[name], self.scene, self.person)

    # Which gesture

    def next_gesture(self, time: float, *, urgent: bool) -> float:
        """Make one gesture, and the pause before it; returns when it is over."""
        style = self.manner.at(time)
        begin = time if urgent else time + self.pause(style)
        if begin > self.script.seconds + 1.0:
            return begin
        own = REPERTOIRE[self.manner.emotion]
        is_own = bool(own) and (urgent or self.rng.random() < style["emblem"] * EMBLEM[self.scene.activity])
        if is_own:
            gesture = self.pick(own)
        elif self.scene.activity in ("task", "dance"):
            gesture = self.errand()
        else:
            gesture = self.pick(CONVERSATION)
        end = self.perform(gesture, begin, style)
        self.script.gestures.append((begin, end))
        if is_own:
            self.script.emblems.append((begin, end))
        return end

    def pick(self, weights: dict[str, float]) -> Gesture:
        """One of these gestures, by the person's taste."""
        return GESTURES[choose(self.rng, {name: often * self.person.taste[name] for name, often in weights.items()})]

    def pause(self, style: Style) -> float:
        """Seconds of rest before the next gesture."""
        rate = style["rate"] * self.person.rate * self.scene.vigour * RATE[self.scene.activity]
        return float(self.rng.exponential(max(1.0 / rate - 1.1, 0.12)))

    def errand(self) -> Gesture:
        """A movement with a purpose of its own: reaching for things, or a figure of a dance."""
        rng, wide = self.rng, self.scene.activity == "dance"
        low, high = (0.05, -0.45, 0.05, -5.0, -50.0), (0.55, 0.45 if wide else 0.2, 0.45, 40.0, 60.0)
        drawn = rng.uniform(low, high, (int(rng.integers(1, 4)) + wide, 5)).tolist()
        poses = tuple(Pose(out, up, fore, elbow, palm) for out, up, fore, elbow, palm in drawn)
        return Gesture(
            poses,
            hands=0.85 if wide else 0.35,
            hold=(0.0, 0.3) if wide else (0.1, 0.8),
            pace=float(rng.uniform(0.6, 0.9) if wide else rng.uniform(0.75, 1.1)),
            trunk=float(rng.normal(0.0, 5.0)),
        )

    # How it is made

    def perform(self, gesture: Gesture, time: float, style: Style) -> float:
        """Move hands and trunk through a gesture; returns when its hold ends."""
        rng, active = self.rng, self.hands_for(gesture)
        unlike = rng.normal(0.0, 0.02, (2, 3)) * (0.3 if gesture.touch else 1.0)
        before = self.script.trunk.now
        self.company.accompany(gesture, time, style, lead=(0.0 if len(active) > 1 else 1.0 - 2.0 * active[0]))
        for step, pose in enumerate(self.sequence(gesture)):
            target = self.target(gesture, pose, style)
            pace, duration = gesture.pace * (0.85 if step == 0 else 1.0), 0.0
            for hand in active:
                goal = target.copy()
                goal[Hand.CHEST] += unlike[hand] * (1.0 - goal[Hand.FROM_ROOM])
                duration = max(duration, self.stroke(hand, time, goal, style, pace))
            self.company.beat(time, duration, style)
            time += duration * float(rng.uniform(0.9, 1.15))
        time += float(rng.uniform(*gesture.hold)) * style["hold"]
        self.retract(time, style, active)
        self.company.relax(time, self.scene.vigour * style["tempo"] ** 0.7, before)
        return time

    def hands_for(self, gesture: Gesture) -> tuple[int, ...]:
        """The hands that make a gesture: (0, 1), (0,) left or (1,) right."""
        both = np.clip(gesture.hands + 0.35 * (self.person.bimanual - 0.5), 0.0, 1.0)
        if gesture.hands >= 1.0 or self.rng.random() < both:
            return (0, 1)
        return (int(self.person.right_handed == (self.rng.random() < 0.85)),)

    def sequence(self, gesture: Gesture) -> list[Pose]:
        """The poses of a gesture, its strokes repeated as often as drawn."""
        again = int(self.rng.integers(gesture.repeat[0], gesture.repeat[1] + 1)) - 1
        return [*gesture.poses, *(gesture.poses[-gesture.cycle :] * again if gesture.cycle else ())]

    def target(self, gesture: Gesture, pose: Pose, style: Style) -> Array:
        """A pose as this person makes it in this mood [Hand.DIM]."""
        rng, vector = self.rng, place(pose, self.scene, self.person)
        if pose.anchor != "chest":
            return vector
        if gesture.touch:
            vector[Hand.CHEST] += rng.normal(0.0, 0.012, 3)
            return vector
        reach = float(np.clip(style["reach"] * self.person.size * self.scene.vigour**0.5, 0.3, 1.9))
        mood = np.array([0.0025 * style["width"], style["height"], 0.0])
        away = CENTRE + reach * (vector[Hand.CHEST] - CENTRE) + mood + rng.normal(0.0, 0.025, 3) - ORIGIN
        limit = 0.97 * (self.person.upper_arm + self.person.forearm) / max(float(np.linalg.norm(away)), 1e-6)
        vector[Hand.CHEST] = ORIGIN + away * min(limit, 1.0)  # no further than the arm goes
        vector[Hand.ELBOW] += style["width"]
        vector[Hand.PALM] += rng.normal(0.0, 18.0)
        vector[Hand.BEND] += rng.normal(0.0, 12.0)
        return vector

    def stroke(self, hand: int, time: float, goal: Array, style: Style, pace: float) -> float:
        """One movement of one hand towards `goal`; returns its duration."""
        rng, track, sharp = self.rng, self.script.hands[hand], style["jerk"]
        way, bow = around(track.now, goal)
        speed = style["tempo"] * self.person.tempo * self.scene.vigour * pace
        duration = (0.24 + 0.52 * way) / speed * (1.04 - 0.2 * sharp) * float(rng.uniform(0.88, 1.14))
        duration = max(duration, 0.5 * way, 0.12)  # no hand is faster than about 4 m/s (peak = 1.875 way / duration)
        begin, step = time + float(rng.exponential(0.02)), goal - track.now
        loose = min(way, 0.6) * (1.0 - 0.6 * sharp)  # soft movements curve, and the wrist trails
        bow[Hand.CHEST] += rng.normal(0.0, 0.09, 3) * way * (1.0 - 0.6 * sharp)
        bow[Hand.BEND], bow[Hand.SIDE] = (
            -45.0 * loose * float(rng.uniform(0.3, 1.3)),
            22.0 * loose * float(rng.normal()),
        )
        track.push(begin, duration, step)
        track.swell(begin, duration, bow)
        rebound = 0.16 * max(sharp - 0.25, 0.0)
        if rebound and way > 0.08:
            track.swell(begin + 0.92 * duration, 0.24, -rebound * step)  # an abrupt stop swings back
        return duration

    def retract(self, time: float, style: Style, active: tuple[int, ...]) -> None:
        """Take the hands back to rest; now and then they settle somewhere else."""
        if self.rng.random() < 0.15:
            self.rest, active = self.rest_pose(style["emblem"]), (0, 1)
        speed = self.scene.vigour * self.person.tempo * style["tempo"] ** 0.7
        for hand in active:
            track, begin = self.script.hands[hand], time + float(self.rng.exponential(0.05))
            way, bow = around(track.now, self.rest)
            duration = max((0.4 + 0.6 * way) / speed, 0.55 * way)
            track.move(begin, duration, self.rest)
            track.swell(begin, duration, bow)
