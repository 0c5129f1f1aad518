"""What the robot says and does, as its user writes it: the contents of the behaviour file, checked.

Reference: docs/reference/pepper.md.
"""

import re
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    ValidationError,
    WithJsonSchema,
    model_validator,
)

from fervor.emotions import EMOTIONS, emotion_index
from fervor.errors import InputError
from fervor.levels import Level
from fervor.protocol.codec import one_sentence
from fervor_pepper.acts import Voice

Mode = Literal["none", "expressive"]
"""`none`: fillers, whatever is shown; `expressive`: reactions to what is shown. The conditions of the paper."""

Line = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=300)]
"""Something to say."""

Seconds = Annotated[float, Field(ge=0, le=600, allow_inf_nan=False)]
SomeSeconds = Annotated[float, Field(gt=0, le=600, allow_inf_nan=False)]


def _colour(value: object) -> object:
    if isinstance(value, str) and re.fullmatch(r"#[0-9a-fA-F]{6}", value):
        return int(value[1:], 16)
    raise ValueError("expected a colour like '#ffcc00', in quotes")


def _emotion(value: str) -> str:
    try:
        return EMOTIONS[emotion_index(value)]
    except InputError as error:
        raise ValueError(error.message) from None


Colour = Annotated[int, BeforeValidator(_colour), WithJsonSchema({"type": "string"})]
EmotionName = Annotated[str, AfterValidator(_emotion)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Reaction(_Part):
    """What to do at one level of an emotion; speech and gesture together are one act."""

    say: bool = Field(default=False, description="speak one of the language's lines for this emotion and level")
    gestures: tuple[Line, ...] = Field((), description="animations, the preferred first; the first that is there runs")
    leds: Colour | None = Field(None, description="colour of the eyes, `'#rrggbb'`")


class Language(_Part):
    """The words of one language."""

    voice: Line = Field(description="the language's name on the robot, as ALTextToSpeech lists it")
    fillers: tuple[Line, ...] = Field(min_length=1, description="what mode `none` says")
    lines: Mapping[EmotionName, Mapping[Level, tuple[Line, ...]]] = Field(
        description="what mode `expressive` says: emotion, level, lines"
    )


class Fillers(_Part):
    """How often mode `none` speaks: the pause between two fillers is drawn evenly from this range."""

    least_s: Seconds = Field(6.0, description="shortest time from one filler to the next")
    most_s: SomeSeconds = Field(14.0, description="longest time from one filler to the next")

    @model_validator(mode="after")
    def _in_order(self) -> "Fillers":
        if self.least_s > self.most_s:
            raise ValueError(f"least_s ({self.least_s:g}) must not exceed most_s ({self.most_s:g})")
        return self


class Timing(_Part):
    """When mode `expressive` reacts."""

    settle_s: Seconds = Field(0.5, description="an emotion and level must be shown so long before they count")
    rest_s: Seconds = Field(2.0, description="pause after any act")
    emotion_rest_s: Seconds = Field(6.0, description="pause after an act for the same emotion, whoever shows it")
    act_timeout_s: SomeSeconds = Field(15.0, description="an act that takes longer is stopped")


class Attention(_Part):
    """Whom the robot answers where it sees several people."""

    to: Literal["intense", "longest"] = Field(
        "intense", description="`intense`: who shows most; `longest`: who has been there longest"
    )
    hold_s: Seconds = Field(5.0, description="it stays with a person at least so long")
    lost_s: SomeSeconds = Field(2.0, description="a person unseen so long is gone, and new when back")


class Behaviour(_Part):
    """The whole file."""

    language: str = Field(description="one of `languages`")
    languages: Mapping[str, Language] = Field(min_length=1, description="words by language code")
    reactions: Mapping[EmotionName, Mapping[Level, Reaction]] = Field(
        description="what to do: emotion, level; what is not listed gets no reaction"
    )
    fillers: Fillers = Field(default_factory=Fillers, description="how often mode `none` speaks")
    timing: Timing = Field(default_factory=Timing, description="when mode `expressive` reacts")
    attention: Attention = Field(default_factory=Attention, description="whom it answers where there are several")

    @model_validator(mode="after")
    def _words_for_every_reaction(self) -> "Behaviour":
        if self.language not in self.languages:
            raise ValueError(f"language {self.language!r} is not among languages; expected one of {self.known}")
        for emotion, levels in self.reactions.items():
            for level, reaction in levels.items():
                if reaction.say and not self.lines(emotion, level):
                    where = f"languages.{self.language}.lines.{emotion}.{level}"
                    raise ValueError(f"reactions.{emotion}.{level} says something, but {where} has no lines")
        return self

    @property
    def known(self) -> str:
        """The languages there are, to be told."""
        return ", ".join(self.languages)

    @property
    def words(self) -> Language:
        """The words of the chosen language."""
        return self.languages[self.language]

    @property
    def voice(self) -> Voice:
        """The chosen language, for the robot."""
        return Voice(self.language, self.words.voice)

    def lines(self, emotion: str, level: Level) -> tuple[str, ...]:
        """What can be said about an emotion at a level."""
        return self.words.lines.get(emotion, {}).get(level, ())

    def spoken_in(self, language: str) -> "Behaviour":
        """The same in another of its languages.

        Raises:
            InputError: it has none of that name, or no lines in it for some reaction.
        """
        if language not in self.languages:
            raise InputError(f"language {language!r} is not in the behaviour; expected one of {self.known}")
        try:
            return Behaviour.model_validate({**dict(self), "language": language})
        except ValidationError as error:
            raise InputError(f"language {language!r} can't be spoken: {one_sentence(error)}") from None
