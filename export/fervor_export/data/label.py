"""Labels: which emotion was meant, and what share of the observers recognised it.

Rules. Intensity = k / n: of n answers, k named the intended emotion (Sun et al., section IV-A). n stays with the label,
for it says how far chance goes. An answer that is none of the eleven emotions counts into n; an empty one does not.
"""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from fervor.emotions import EMOTIONS, SYNONYMS, emotion_index
from fervor.errors import DataError, InputError

NEUTRAL = "neutral"
"""Recognised as neutral is not an intensity: these clips are reported apart."""

_SEPARATORS = (r"[\n\t;|,]", r"/(?!a\b)")  # the second only where the first is not to be found; n/a is no list
_NO_ANSWER = frozenset({"", "na", "n/a", "nan", "null", "-"})
_WRAPPING = " \t\r\n'\"`[](){}"
_COUNTED = re.compile(r"(?P<name>\D*?)\s*[:=*]?\s*(?P<count>\d+)")
_COUNTED_FIRST = re.compile(r"(?P<count>\d+)\s*[:=*]?\s*(?P<name>\D+)")
_RUN = re.compile("(?:" + "|".join([*EMOTIONS, *sorted(SYNONYMS, key=len, reverse=True)]) + ")+", re.IGNORECASE)
_NAME = re.compile("|".join([*EMOTIONS, *sorted(SYNONYMS, key=len, reverse=True)]), re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Label:
    """What a clip was meant to show, and how intensely it shows it."""

    emotion: str
    """The intended one."""
    intensity: float  # in [0, 1]
    votes: int | None = None
    """k: observers who named the intended emotion; None where only a number was given."""
    observers: int | None = None
    """n: observers asked; None where unknown."""


def known_emotion(name: str) -> str:
    """The emotion that a data set calls `name`: any case, synonyms understood.

    Raises:
        DataError: none of the eleven.
    """
    try:
        return EMOTIONS[emotion_index(name)]
    except InputError as error:
        raise DataError(error.message) from None


def count_answers(responses: str) -> Counter[str]:
    """How often each answer was given; known emotions by our names, others in lower case.

    Understood are lists with any of `; , | /`, tabs, line ends or blanks between the answers, in brackets and quotes or
    not, and counts: `anger: 7; joy: 4`, `{"anger": 7}`, `anger 7 joy 4`. Answers may be of several words where
    something other than blanks parts them.
    """
    counts: Counter[str] = Counter()
    for name, count in _answers(responses):
        try:
            answer = known_emotion(name)
        except DataError:
            answer = " ".join(name.lower().split())
        counts[answer] += count
    return counts


def label_from_responses(emotion: str, responses: str) -> Label:
    """The label of a clip from its observers' answers.

    Raises:
        DataError: an emotion that is not known, or no answer at all.
    """
    intended = known_emotion(emotion)
    counts = count_answers(responses)
    observers = counts.total()
    if not observers:
        raise DataError(f"no responses in {responses!r}; expected the observers' answers")
    votes = counts[intended]
    return Label(intended, votes / observers, votes, observers)


def label_from_votes(emotion: str, votes: str) -> Label:
    """The label of a clip from "k/n".

    Raises:
        DataError: something else than two whole numbers with 0 ≤ k ≤ n and n ≥ 1.
    """
    intended = known_emotion(emotion)
    match = re.fullmatch(r"\s*(\d+)\s*(?:/|of)\s*(\d+)\s*", votes)
    if match is None:
        raise DataError(f"votes are {votes!r}; expected k/n, such as 7/11")
    recognised, observers = int(match[1]), int(match[2])
    if not observers or recognised > observers:
        raise DataError(f"votes are {votes.strip()}; expected no more than all of at least one observer")
    return Label(intended, recognised / observers, recognised, observers)


def _answers(text: str) -> Iterator[tuple[str, int]]:
    """Answers as they were written, each with its count."""
    parts = _parted(text.strip(_WRAPPING))
    for part in (part.strip(_WRAPPING) for part in parts):
        if part.lower() in _NO_ANSWER:
            continue
        counted = _COUNTED.fullmatch(part) or _COUNTED_FIRST.fullmatch(part)
        if counted and counted["name"].strip(_WRAPPING + ":="):
            yield counted["name"].strip(_WRAPPING + ":="), int(counted["count"])
        elif _RUN.fullmatch(part):  # "joyjoyanger": nothing at all between the answers
            yield from ((name, 1) for name in _NAME.findall(part))
        else:
            yield part, 1


def _parted(text: str) -> list[str]:
    """The text cut at whatever parts its answers."""
    for separator in _SEPARATORS:
        if re.search(separator, text, re.IGNORECASE):
            return re.split(separator, text, flags=re.IGNORECASE)
    if re.search(r"\d", text):  # "anger 7 joy 4" or "7 anger 4 joy"
        pattern = r"[^\s\d]\D*?\s*\d+" if text[:1].isalpha() else r"\d+\s*[^\s\d]\D*?(?=\s*\d|$)"
        return [match.group() for match in re.finditer(pattern, text)]
    return text.split()
