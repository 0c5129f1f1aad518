"""A robot that only prints what it would do, with times: to try a behaviour without a robot."""

import sys
import threading
import time
from collections.abc import Callable
from typing import TextIO

from fervor_pepper.acts import Act

SPEECH_S_PER_CHARACTER = 0.07
"""About how long Pepper speaks at its usual speed."""

GESTURE_S = 2.5
"""About how long a gesture of Pepper's takes."""


class DryRobot:
    """Prints a line an act, and takes as long over it as a robot would."""

    def __init__(self, out: TextIO | None = None, *, now: Callable[[], float] = time.monotonic) -> None:
        self._out = sys.stdout if out is None else out
        self._now = now
        self._begun = now()
        self._stopped = threading.Event()

    def animations(self) -> None:
        """It can't say: any gesture will do."""

    def perform(self, act: Act) -> str | None:
        """Print the act, and be busy for a while."""
        self._stopped.clear()
        gesture = act.gestures[0] if act.gestures else None
        what = [f'says "{act.say}" [{act.voice.code}]'] if act.say else []
        what += [f"plays {gesture}"] if gesture else []
        what += [f"eyes #{act.leds:06x}"] if act.leds is not None else []
        why = f"{act.level} {act.emotion}, body {act.body}" if act.emotion else "filler"
        self._out.write(f"{self._now() - self._begun:7.1f} s  {why}: {', '.join(what)}\n")
        self._out.flush()
        self._stopped.wait(max(len(act.say or "") * SPEECH_S_PER_CHARACTER, GESTURE_S if gesture else 0.0))
        return gesture

    def stop(self) -> None:
        """Be done at once."""
        self._stopped.set()
