"""A person: how somebody stands, sits and moves whatever they feel, and how their feelings show.

People differ in posture and habit as much as emotions do (Wallbott 1998: "encoder differences"), so neither a bent
back nor a quick hand is a feeling by itself. Everything here is drawn once per person and kept over all their clips.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fervor_export.synthetic.channels import CHANNELS
from fervor_export.synthetic.gestures import GESTURES

Array = npt.NDArray[np.float64]

USUAL_STEP_HZ = 0.92
"""Strides a second of an average walker."""


@dataclass(frozen=True, slots=True)
class Person:
    """Habits of one person; angles in degrees, lengths in metres."""

    name: str
    right_handed: bool
    tempo: float  # x, habitual speed
    size: float  # x, habitual size of gestures
    rate: float  # x, habitual number of gestures
    unrest: float  # x, sway
    nod: float  # x, habitual movement of the head
    bimanual: float  # 0..1, readiness to use both hands
    upper_arm: float
    forearm: float
    hang: float  # share of the arm's length at which it hangs
    arm_out: float  # m, hands beside the body
    slump: float
    lean: float
    head: float
    turn: Array  # [2] habitual head yaw and roll
    elbows: float  # deg, elbows out
    breath_hz: float
    step_hz: float  # strides a second when walking
    idiom: Array  # [channel] this person's deviation from the table's strong value, in spreads
    taste: dict[str, float]  # gesture → x, how much this person likes it

    @classmethod
    def draw(cls, rng: np.random.Generator, name: str) -> "Person":
        """A new person."""
        return cls(
            name=name,
            right_handed=bool(rng.random() < 0.9),
            tempo=float(np.exp(rng.normal(0.0, 0.2))),
            size=float(np.exp(rng.normal(0.0, 0.24))),
            rate=float(np.exp(rng.normal(0.0, 0.35))),
            unrest=float(np.exp(rng.normal(0.0, 0.3))),
            nod=float(np.exp(rng.normal(0.0, 0.3))),
            bimanual=float(rng.beta(2.5, 2.5)),
            upper_arm=float(rng.normal(0.30, 0.012)),
            forearm=float(rng.normal(0.26, 0.01)),
            hang=float(rng.uniform(0.97, 1.06)),
            arm_out=float(rng.uniform(0.02, 0.09)),
            slump=float(rng.normal(2.0, 6.0)),
            lean=float(rng.normal(0.0, 4.0)),
            head=float(rng.normal(1.0, 5.2)),
            turn=rng.normal(0.0, 3.0, 2),
            elbows=float(rng.normal(18.0, 9.0)),
            breath_hz=float(rng.uniform(0.2, 0.36)),
            step_hz=float(rng.normal(USUAL_STEP_HZ, 0.06)),
            idiom=np.clip(rng.normal(0.0, 1.0, len(CHANNELS)), -2.0, 2.0),
            taste={gesture: float(np.exp(rng.normal(0.0, 0.7))) for gesture in GESTURES},
        )
