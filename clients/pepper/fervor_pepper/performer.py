"""The behaviour core: from estimates to acts. No robot, no socket, no clock; time and ends of acts are told to it.

The caller's duties: hand in every estimate, the end of every act, and a `tick` now and then (ten a second will do);
carry out the commands that come back, in order. `now` is in seconds on one clock of the caller's, and never falls.
"""

import random
from collections.abc import Sequence

from fervor.protocol.messages import Estimate
from fervor_pepper.acts import Act, Command, Stop
from fervor_pepper.behaviour import Behaviour, Mode
from fervor_pepper.fillers import Filler, FillerTimes
from fervor_pepper.phase import TRANSITIONS, Cue, Phase
from fervor_pepper.reactions import Answer, Reactions

STOP_S = 3.0
"""How long a robot may take to stop; then it is taken to be free."""


class Performer:
    """Decides what a robot does, one act at a time."""

    def __init__(self, behaviour: Behaviour, mode: Mode = "expressive", *, seed: int | None = None) -> None:
        """`seed`: of what is chosen at random; the same seed and the same events give the same acts."""
        dice = random.Random(seed)  # noqa: S311  # small talk, not secrets
        self.mode: Mode = mode
        self.phase = Phase.IDLE
        self._behaviour = behaviour
        self._reactions = Reactions(behaviour, dice) if mode == "expressive" else None
        self._fillers = FillerTimes(behaviour, dice) if mode == "none" else None
        self._until = 0.0  # seconds, when this phase is over
        self._count = 0
        self._doing: Answer | Filler | None = None

    def perceive(self, estimate: Estimate, now: float) -> Sequence[Command]:
        """An estimate came."""
        if self._reactions is None:  # whatever is shown: not even the time of an estimate moves anything
            return ()
        self._reactions.perceive(estimate, now)
        return self.tick(now)

    def leave(self, body: str) -> None:
        """A person is gone."""
        if self._reactions is not None:
            self._reactions.leave(body)

    def ended(self, number: int, now: float) -> Sequence[Command]:
        """The robot has finished an act; one that was given up before is no news."""
        return self._over(number, Cue.ENDED, now)

    def failed(self, number: int, now: float, *, reached: bool = True) -> Sequence[Command]:
        """An act went wrong. Where it never `reached` the robot, it is owed again."""
        if number == self._count and not reached and isinstance(self._doing, Answer) and self._reactions is not None:
            self._reactions.missed(self._doing)
            self._doing = None
        return self._over(number, Cue.FAILED, now)

    def tick(self, now: float) -> Sequence[Command]:
        """Time has passed."""
        if self.phase is Phase.RESTING and now >= self._until:
            self._move(Cue.RESTED)
        if self.phase is Phase.IDLE:
            return self._begin(now)
        if self.phase in (Phase.ACTING, Phase.STOPPING) and now >= self._until:
            return self._overdue(now)
        return ()

    def _begin(self, now: float) -> Sequence[Command]:
        source = self._reactions or self._fillers
        assert source is not None
        self._doing = source.wish(now)
        if self._doing is None:
            return ()
        self._move(Cue.START)
        self._until = now + self._behaviour.timing.act_timeout_s
        self._count += 1
        return (self._act(self._doing),)

    def _act(self, doing: Answer | Filler) -> Act:
        if isinstance(doing, Filler):
            return Act(self._count, self._behaviour.voice, say=doing.say)
        return Act(
            self._count,
            self._behaviour.voice,
            say=doing.say,
            gestures=doing.reaction.gestures,
            leds=doing.reaction.leds,
            body=doing.body,
            emotion=doing.shown.emotion,
            level=doing.shown.level,
        )

    def _overdue(self, now: float) -> Sequence[Command]:
        stopping = self.phase is Phase.STOPPING
        self._move(Cue.OVERDUE)
        if stopping:
            self._rest(now)
            return ()
        self._until = now + STOP_S
        return (Stop(self._count),)

    def _over(self, number: int, cue: Cue, now: float) -> Sequence[Command]:
        if number == self._count and self.phase in (Phase.ACTING, Phase.STOPPING):
            self._move(cue)
            self._rest(now)
        return self.tick(now)

    def _rest(self, now: float) -> None:
        self._until = now + self._behaviour.timing.rest_s
        if isinstance(self._doing, Answer) and self._reactions is not None:
            self._reactions.ended(self._doing, now)
        self._doing = None

    def _move(self, cue: Cue) -> None:
        self.phase = TRANSITIONS[self.phase, cue]
