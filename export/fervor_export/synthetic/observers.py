"""Observers: how many of them name the intended emotion after seeing a take.

What a take shows of its emotion goes through a psychometric curve (a logistic with a floor of guessing and a ceiling of
lapses); n observers answer, and the intensity is the share of them who name the intended emotion, as in the EBMDB.
Emotions differ in how much must show before they are recognised: in the EBMDB's upper-body stick figures joy, anger,
fear, sadness and neutral are recognised best, relief, disgust and surprise hardly (Volkova et al. 2014).
"""

from dataclasses import dataclass

import numpy as np

GUESS, LAPSE = 0.05, 0.06
"""Share who name the emotion although nothing shows (a bit under 1/11), and who miss it when it is plain."""

SLOPE = 6.5
"""Steepness of the curve, per unit of what is visible."""

HALFWAY = {
    "amusement": 0.50, "anger": 0.45, "disgust": 0.58, "fear": 0.50, "joy": 0.48, "neutral": 0.50, "pride": 0.55,
    "relief": 0.54, "sadness": 0.45, "shame": 0.55, "surprise": 0.44,
}  # fmt: skip
"""What must be visible for half of the observers to see it (0 a weak, 1 a strong take of an average person)."""

CONFUSED: dict[frozenset[str], float] = {
    frozenset(("amusement", "joy")): 0.35,
    frozenset(("joy", "pride")): 0.15,
    frozenset(("anger", "disgust")): 0.20,
    frozenset(("sadness", "shame")): 0.40,
    frozenset(("fear", "surprise")): 0.35,
    frozenset(("fear", "shame")): 0.12,
    frozenset(("sadness", "relief")): 0.15,
    frozenset(("joy", "surprise")): 0.12,
    frozenset(("joy", "anger")): 0.10,
    frozenset(("anger", "pride")): 0.08,
    frozenset(("disgust", "fear")): 0.15,
    frozenset(("relief", "pride")): 0.08,
}
"""Share of those who recognise one emotion's display that would as soon have named the other."""


def recognised(emotion: str, visible: float) -> float:
    """Share of all observers who name the emotion that a take displays, given how much of it is visible."""
    curve = 1.0 / (1.0 + np.exp(-SLOPE * (visible - HALFWAY[emotion])))
    return float(GUESS + (1.0 - GUESS - LAPSE) * curve)


def named(intended: str, displayed: str, visible: float) -> float:
    """Share who name the intended emotion when the body displays `displayed`, which may be another one."""
    share = recognised(displayed, visible)
    if intended == displayed:
        return share
    if intended == "neutral":  # nothing seen is called neutral
        return float(np.clip(0.97 - 1.1 * (share - GUESS), 0.02, 0.97))
    alike = CONFUSED.get(frozenset((intended, displayed)), 0.0)
    return GUESS * (1.0 - share) + alike * share * 0.8


@dataclass(frozen=True, slots=True)
class Panel:
    """A group of observers."""

    size: int

    @classmethod
    def draw(cls, rng: np.random.Generator) -> "Panel":
        """As many as the EBMDB is said to have per clip (11), give or take."""
        return cls(int(rng.integers(9, 14)))

    def vote(self, rng: np.random.Generator, share: float) -> float:
        """Share of this panel's answers that name the intended emotion."""
        return float(rng.binomial(self.size, share) / self.size)
