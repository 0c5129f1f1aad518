"""Mode `expressive` of the paper: weak is answered by speech, strong by a gesture, as the behaviour says.

Rules: only whom the robot attends to is answered, and only what that person still shows · a change of what is shown is
answered once · after an act for an emotion, that emotion is not answered for `emotion_rest_s`; what is still shown then
is answered then.
"""

import random
from collections.abc import Mapping
from dataclasses import dataclass

from fervor.levels import Level
from fervor.protocol.messages import Estimate
from fervor_pepper.audience import Audience, Shown
from fervor_pepper.behaviour import Behaviour, Reaction
from fervor_pepper.choice import Choice


@dataclass(frozen=True, slots=True)
class Answer:
    """What to do for a person."""

    body: str
    shown: Shown
    say: str | None
    reaction: Reaction


class Reactions:
    """What to answer to whom, and when."""

    def __init__(self, behaviour: Behaviour, dice: random.Random) -> None:
        self._behaviour = behaviour
        self._audience = Audience(behaviour.attention, behaviour.timing.settle_s)
        self._lines: Mapping[tuple[str, Level], Choice[str]] = {
            (emotion, level): Choice(lines, dice)
            for emotion, levels in behaviour.words.lines.items()
            for level, lines in levels.items()
            if lines
        }
        self._rested: dict[str, float] = {}  # emotion: seconds, when it may be answered again

    def perceive(self, estimate: Estimate, now: float) -> None:
        """Take in an estimate."""
        self._audience.perceive(estimate, now)

    def leave(self, body: str) -> None:
        """A person is gone."""
        self._audience.leave(body)

    def wish(self, now: float) -> Answer | None:
        """The answer that is due at `now`, once; None while none is."""
        person = self._audience.attended(now)
        if person is None or person.shown is None or not (person.owed and person.trusted):
            return None
        shown = person.shown
        reaction = self._behaviour.reactions.get(shown.emotion, {}).get(shown.level)
        if reaction is None or now < self._rested.get(shown.emotion, now):
            return None
        person.owed = False
        say = self._lines[shown.emotion, shown.level].draw() if reaction.say else None
        return Answer(person.body, shown, say, reaction)

    def ended(self, answer: Answer, now: float) -> None:
        """An answer was given, or failed for good."""
        self._rested[answer.shown.emotion] = now + self._behaviour.timing.emotion_rest_s

    def missed(self, answer: Answer) -> None:
        """An answer never reached its person."""
        self._audience.owe_again(answer.body, answer.shown)
