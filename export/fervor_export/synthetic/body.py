"""From a script to joints: the pose of the rig C13 at any times.

Trunk and head are turned by degrees of pitch (forward +), yaw (left +) and roll (to the right +); hands are places,
solved by `arm`; legs keep their place in the room while the pelvis tilts. The root is not part of the rig, but the
pelvis' tilt is known here, so that what belongs to the room (gravity, thighs) stays there.
"""

from dataclasses import dataclass

import numpy as np

from fervor import rotations
from fervor_export.synthetic import arm, gait
from fervor_export.synthetic.channels import INDEX
from fervor_export.synthetic.script import Hand, Laugh, Script, Torso
from fervor_export.synthetic.tracks import Array, bump

LUMBAR, THORACIC = 0.20, 0.25
"""Metres from the pelvis to the chest joint, and from there to the middle between the shoulders."""

LIMITS = np.array([[60.0, 40.0, 30.0], [55.0, 35.0, 28.0], [48.0, 30.0, 24.0], [55.0, 72.0, 38.0]])
"""Degrees of pitch, yaw and roll that pelvis, spine, chest and head can reach (White & Panjabi 1990, added up)."""

_MIRROR = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, slots=True)
class _Frames:
    """A script at given times."""

    script: Script
    times: Array  # [frame] seconds
    style: dict[str, Array]  # channel → [frame]
    phase: Array  # [frame] radians of the gait cycle
    walking: float  # 1 or 0
    texture: Array  # [frame, 21]
    bounce: Array  # [frame] degrees


@dataclass(frozen=True, slots=True)
class _Trunk:
    """Trunk and head at given times; the pelvis relative to the room, the others to the segment below them."""

    pelvis: Array  # [frame, 4]
    spine: Array
    chest: Array
    head: Array
    shrug: Array  # [frame] metres


def pose(script: Script, times: Array) -> Array:
    """Local joint rotations [frame, 13, 4] xyzw at `times` [frame] in seconds, at least two."""
    frames = _frames(script, times)
    trunk = _trunk(frames)
    out = np.empty((len(times), 13, 4))
    out[:, 0], out[:, 1], out[:, 2] = trunk.spine, trunk.chest, trunk.head
    out[:, 3:9] = _arms(frames, trunk).reshape(-1, 6, 4)
    out[:, 9:13] = _legs(frames, trunk).reshape(-1, 4, 4)
    return out


def _frames(script: Script, times: Array) -> _Frames:
    """Everything that trunk, arms and legs share."""
    values, unrest = script.manner.over(times), script.unrest  # [frame, channel]
    style = {name: values[:, index] for name, index in INDEX.items()}
    walking = float(script.scene.posture == "walk")
    pace = script.person.step_hz * style["cadence"] * script.scene.vigour**0.4 * script.scene.pace**0.5
    steps = np.concatenate(([0.0], np.cumsum(0.5 * (pace[1:] + pace[:-1]) * np.diff(times))))
    texture = unrest.texture.at(times) * (0.35 + 0.45 * walking + 0.25 * style["sway"])[:, None]
    varied = 0.75 + 0.25 * np.clip(unrest.drift.at(times)[:, 0], -1.5, 1.5)
    bounce = style["bounce"] * varied * np.sin(2.0 * np.pi * unrest.bounce_hz * times + unrest.bounce)
    return _Frames(script, times, style, 2.0 * np.pi * steps + unrest.step, walking, texture, bounce)


def _trunk(frames: _Frames) -> _Trunk:
    """Pelvis, spine, chest and head: posture, habit, gestures, sway, breath, laughter and gait added up."""
    script, times, style, bounce = frames.script, frames.times, frames.style, frames.bounce
    person, scene, moved = script.person, script.scene, script.trunk.at(times)
    lean, slump = person.lean + style["lean"], person.slump + style["slump"]
    hinge = 0.0 if scene.posture == "sit" else 0.35  # standing bodies lean in their hips, too
    breath = style["breath"] * np.sin(2.0 * np.pi * person.breath_hz * times + script.unrest.breath)
    shake, rock = _laughter(script.laughs, times)
    yaw, roll, pitch = (frames.walking * wave for wave in gait.trunk(frames.phase, style["stride"]))
    bouncy = 1.0 + 0.4 * style["bounce"]  # a bouncing gait nods more
    sway = 1.4 * script.unrest.sway.at(times) * (style["sway"] * person.unrest)[:, None]
    fine = 0.25 * frames.texture[:, :9].reshape(-1, 3, 3)

    angles = np.zeros((len(times), 4, 3))  # pelvis, spine, chest, head: pitch, yaw, roll
    pelvis, spine, chest, head = (angles[:, index] for index in range(4))
    pelvis += np.stack((scene.pelvis + hinge * lean + 0.3 * sway[:, 0], yaw, roll), axis=-1)
    spine += (
        moved[:, Torso.SPINE]
        + 1.3 * sway[:, 0:3]
        + fine[:, 0]
        + np.stack((pitch * bouncy, -1.3 * yaw, -0.9 * roll), axis=-1)
    )
    spine[:, 0] += -0.8 * scene.pelvis + (0.85 - hinge) * lean + 0.35 * slump + 0.35 * bounce + rock + 0.6 * shake
    chest += moved[:, Torso.THORAX] + 0.7 * sway[:, 3:6] + 0.5 * fine[:, 1]
    chest[:, 0] += 0.15 * lean + 0.65 * slump - 0.7 * breath + 0.2 * bounce + 0.9 * shake
    chest[:, 1] -= 0.4 * yaw
    # The head stays level against leans and gestures, not against a slump: that is what a hanging head is.
    level = (
        0.55 * (lean + moved[:, Torso.SPINE.start] + moved[:, Torso.THORAX.start] + 0.2 * scene.pelvis) + 0.25 * slump
    )
    head += moved[:, Torso.HEAD] + 1.6 * sway[:, 6:9] * (person.nod * style["nod"][:, None]) ** 0.5 + 1.6 * fine[:, 2]
    head[:, 0] += person.head + scene.look + style["head"] - level - 0.3 * bounce + 1.8 * shake - 0.9 * rock
    head[:, 1] += person.turn[0] + scene.gaze + script.way * style["aside"] - 0.6 * (spine[:, 1] + chest[:, 1])
    head[:, 2] += person.turn[1] + script.way * style["tilt"] - 0.4 * (spine[:, 2] + chest[:, 2])
    turns = rotations.from_euler("YXZ", _limit(angles)[..., [1, 0, 2]])
    shrug = np.clip(moved[:, Torso.SHRUG] + style["shrug"] + 0.003 * breath + 0.004 * shake, -0.04, 0.1)
    return _Trunk(turns[:, 0], turns[:, 1], turns[:, 2], turns[:, 3], shrug)


def _limit(angles: Array) -> Array:
    """Angles [frame, 4, 3] that approach their limits softly."""
    limited: Array = LIMITS * np.tanh((np.abs(angles) / LIMITS) ** 4) ** 0.25 * np.sign(angles)
    return limited


def _laughter(laughs: list[Laugh], times: Array) -> tuple[Array, Array]:
    """Shaking (4 to 6 Hz) and rocking (about 1 Hz) of laughter in degrees, each [frame] (Niewiadomski et al. 2014)."""
    shake, rock = np.zeros(len(times)), np.zeros(len(times))
    for bout in laughs:
        age = times - bout.start
        envelope = bump(age / bout.duration) ** 0.5 * bout.strength
        shake += envelope * 1.9 * np.sin(2.0 * np.pi * bout.hz * age)
        rock += envelope * 4.0 * np.sin(2.0 * np.pi * bout.hz * 0.27 * age)
    return shake, rock


def _arms(frames: _Frames, trunk: _Trunk) -> Array:
    """Shoulder, elbow and wrist of both arms [frame, 2, 3, 4]; the right arm is solved as a left one and mirrored."""
    script, times, person = frames.script, frames.times, frames.script.person
    hands = np.stack([track.at(times) for track in script.hands], axis=1)  # [frame, 2, Hand.DIM]
    drift = script.unrest.drift.at(times)
    fine = frames.texture[:, 13:21].reshape(-1, 2, 4)
    tremor = script.unrest.tremor.at(times).reshape(-1, 2, 6) * frames.style["tremble"][:, None, None]
    speed = _speed(hands, times)  # [frame, 2]; noise grows with it (Harris & Wolpert 1998)

    wrist = _wrists(frames, trunk, hands)
    wrist = wrist + 0.006 * drift[:, 2:8].reshape(-1, 2, 3) * frames.style["sway"][:, None, None]
    wrist = arm.outside_body(wrist + (0.0012 + 0.010 * speed[..., None]) * fine[..., :3] + 0.0035 * tremor[..., :3])
    flap = fine[..., 3] * (1.0 + 7.0 * speed)
    spread = 0.6 * hands[..., Hand.SWING] * frames.style["width"][:, None]  # open bodies turn hanging elbows out, too
    shoulder = np.zeros_like(wrist)
    shoulder[..., 0], shoulder[..., 1] = arm.SHOULDER, trunk.shrug[:, None]
    turns = arm.solve(
        wrist,
        shoulder,
        elbow_out=np.maximum(hands[..., Hand.ELBOW] + 2.0 * drift[:, 8:10] + spread, -2.0),
        palm=np.clip(hands[..., Hand.PALM] + tremor[..., 3] + 3.0 * drift[:, 10:12], -85.0, 85.0),
        bend=np.clip(hands[..., Hand.BEND] + tremor[..., 4] + 2.5 * drift[:, 12:14] + flap, -65.0, 65.0),
        side=np.clip(hands[..., Hand.SIDE] + 0.7 * tremor[..., 5] + 0.5 * flap, -28.0, 22.0),
        upper=person.upper_arm,
        fore=person.forearm,
    )
    turns[:, 1] = rotations.mirror(turns[:, 1])
    return turns


def _wrists(frames: _Frames, trunk: _Trunk, hands: Array) -> Array:
    """Where the script wants the wrists [frame, 2, 3]: chest axes, X outward from the midline."""
    script = frames.script
    scale = (script.person.upper_arm + script.person.forearm) / 0.56
    below = rotations.multiply(trunk.pelvis, trunk.spine)
    thorax = rotations.multiply(below, trunk.chest)  # chest axes → room
    neck = rotations.rotate(below, np.array([0.0, LUMBAR, 0.0]))
    neck = neck + rotations.rotate(thorax, np.array([0.0, THORACIC, 0.0]))
    shift = np.stack((neck, neck * _MIRROR), axis=1) - np.array([0.0, LUMBAR + THORACIC, 0.0])
    room = hands[..., Hand.ROOM] * scale - hands[..., Hand.FROM_ROOM, None] * shift
    room = room + hands[..., Hand.SWING, None] * (_swing(frames) + _carriage(frames.style)[:, None])
    to_chest = rotations.conjugate(np.stack((thorax, rotations.mirror(thorax)), axis=1))  # [frame, 2, 4]
    wrists: Array = hands[..., Hand.CHEST] + rotations.rotate(to_chest, room)
    return wrists


def _speed(hands: Array, times: Array) -> Array:
    """Speed of the planned hands [frame, 2] in metres a second, at most 2."""
    place = hands[..., Hand.CHEST] + hands[..., Hand.ROOM]
    speed: Array = np.minimum(np.linalg.norm(np.gradient(place, times, axis=0), axis=-1), 2.0)
    return speed


def _carriage(style: dict[str, Array]) -> Array:
    """How mood displaces hanging hands [frame, 3] in metres.

    Open bodies carry the arms off the trunk, tense ones bend the elbows (Roether et al. 2009: fear and anger).
    """
    tense = np.maximum(style["shrug"], 0.0)
    return np.stack((0.0022 * style["width"], 1.1 * tense, 0.9 * tense), axis=-1)


def _swing(frames: _Frames) -> Array:
    """How far walking displaces hanging hands [frame, 2, 3] in metres; elbows bend in front."""
    person, style = frames.script.person, frames.style
    length = person.upper_arm + person.forearm
    wave = frames.walking * gait.arm_swing(frames.phase)  # [frame, 2]
    swing = style["swing"] * person.size**0.7 * frames.script.scene.drive
    amplitude = np.radians(np.minimum(20.0 * swing * style["stride"], 65.0))[:, None]
    angle = amplitude * (wave + 0.15 * frames.walking)
    bent = 0.05 * np.minimum(swing, 2.2)[:, None] ** 1.5 * np.maximum(wave + 0.2 * frames.walking, 0.0)
    return np.stack((-0.02 * wave, length * (1.0 - np.cos(angle)) + bent, length * np.sin(angle)), axis=-1)


def _legs(frames: _Frames, trunk: _Trunk) -> Array:
    """Hip and knee rotations [frame, side, joint, 4]: left hip, left knee, right hip, right knee."""
    script, style, scene = frames.script, frames.style, frames.script.scene
    raised, bent = np.array(scene.thigh), np.array(scene.knee)
    if frames.walking:
        raised, bent = gait.legs(frames.phase, 1.1 * style["stride"] * scene.vigour**0.2 * scene.pace)
    elif scene.posture == "stand":
        dip = 1.6 * (style["bounce"] + np.maximum(frames.bounce, -0.6 * style["bounce"]))[:, None]
        raised, bent = raised + dip, bent + 2.0 * dip
    moved = script.legs.at(frames.times) + (0.3 * scene.feet + 0.6 * frames.walking) * frames.texture[:, 9:13]
    flexion, knee = raised + moved[:, :2], np.clip(bent + moved[:, 2:], 0.0, 140.0)  # [frame, 2]
    spread = np.broadcast_to(np.array(scene.spread) * (1.0, -1.0), flexion.shape)
    # A hanging thigh is spread about the forward axis, a sitting body's about the vertical one.
    axes = "YX" if scene.posture == "sit" else "ZX"
    thigh = rotations.from_euler(axes, np.stack((spread, -flexion), axis=-1))
    hip = rotations.multiply(rotations.conjugate(trunk.pelvis)[:, None], thigh)
    return np.stack((hip, rotations.from_euler("X", knee[..., None])), axis=2)
