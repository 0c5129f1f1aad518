"""Behaviour files: the packaged one is whole in every language; a wrong one is told by line and key."""

from pathlib import Path

import pytest

from fervor.errors import InputError
from fervor.levels import Level
from fervor_pepper.behaviour_file import (
    BehaviourError,
    default_behaviour,
    default_text,
    parse_behaviour,
    read_behaviour,
)

PAPER = {"joy": "you look so happy!", "surprise": "why are you surprised?", "sadness": "what happened to you?"}


def test_the_packaged_behaviour_has_the_papers_lines_first() -> None:
    behaviour = default_behaviour()
    assert behaviour.voice.name == "English"
    assert {emotion: behaviour.lines(emotion, Level.WEAK)[0] for emotion in PAPER} == PAPER
    assert {"oh", "hmm"} <= set(behaviour.words.fillers)


@pytest.mark.parametrize("language", ["en", "de", "fr", "zh", "ja"])
def test_every_language_has_as_much_to_say(language: str) -> None:
    behaviour, english = default_behaviour().spoken_in(language), default_behaviour()
    assert behaviour.voice.code == language
    assert len(behaviour.words.fillers) == len(english.words.fillers)
    for emotion in PAPER:
        assert len(behaviour.lines(emotion, Level.WEAK)) == len(english.lines(emotion, Level.WEAK))
        assert len(behaviour.reactions[emotion][Level.STRONG].gestures) >= 3


def test_a_language_that_is_not_there_is_told() -> None:
    with pytest.raises(InputError, match="language 'tlh' is not in the behaviour; expected one of en, de, fr, zh, ja"):
        default_behaviour().spoken_in("tlh")


def test_a_file_of_ones_own(tmp_path: Path) -> None:
    path = tmp_path / "my.yaml"
    path.write_text(
        "language: nl\n"
        "languages:\n"
        "  nl:\n"
        "    voice: Dutch\n"
        "    fillers: [hè]\n"
        "    lines: {happy: {strong: [wat ben je blij!]}}\n"
        "reactions:\n"
        "  happy: {strong: {say: true, gestures: [dans], leds: '#ffcc00'}}\n",
        encoding="utf-8",
    )
    behaviour = read_behaviour(path)
    reaction = behaviour.reactions["joy"][Level.STRONG]
    assert (reaction.leds, reaction.gestures, behaviour.timing.rest_s) == (0xFFCC00, ("dans",), 2.0)
    assert behaviour.lines("joy", Level.STRONG) == ("wat ben je blij!",)


WRONG = [
    ("rest_s: 2", "rest_s: soon", "timing.rest_s: input should be a valid number.*but 'soon' came"),
    ("rest_s: 2", "pause_s: 2", "timing.pause_s is not a key of behaviours"),
    ("  joy:\n    weak: {say", "  glee:\n    weak: {say", "reactions.glee.*emotion 'glee' is not known"),
    ("surprise:\n    weak: {say", "surprise:\n    mild: {say", "reactions.surprise.mild.*'weak' or 'strong'"),
    (
        "weak: {say: true}",
        "weak: {say: true, leds: yellow}",
        "leds: expected a colour like '#ffcc00', in quotes, but 'yellow' came",
    ),
    ("to: intense", "to: nearest", "attention.to: input should be 'intense' or 'longest'"),
    ("least_s: 6", "least_s: 60", r"fillers: least_s \(60\) must not exceed most_s \(14\)"),
    ('["oh", "hmm", "uh-huh", "I see", "well"]', "[]", "languages.en.fillers"),
]


@pytest.mark.parametrize(("old", "new", "said"), WRONG, ids=[new.strip().splitlines()[0] for _, new, _ in WRONG])
def test_what_is_wrong_is_told_by_line_and_key(old: str, new: str, said: str) -> None:
    before, _, after = default_text().partition(old)
    assert after
    with pytest.raises(BehaviourError, match=said) as caught:
        parse_behaviour(before + new + after, "my.yaml")
    told = int(caught.value.message.removeprefix("my.yaml, line ").partition(":")[0])
    # The line of the change, or of what it stands in.
    assert 0 <= before.count("\n") + 1 - told <= 2 or told == before.count("\n") + 1 + new.count("\n")
    assert "\n" not in caught.value.message


def test_the_lines_that_a_reaction_needs_must_be_there() -> None:
    text = default_text().replace("  joy:\n    weak: {say: true}", "  joy:\n    weak: {say: true, gestures: [wave]}")
    assert parse_behaviour(text, "x").reactions["joy"][Level.WEAK].gestures == ("wave",)
    text = default_text().replace("strong:\n      gestures:", "strong:\n      say: true\n      gestures:", 1)
    with pytest.raises(BehaviourError, match=r"reactions.joy.strong says something, but languages.en.lines.joy.strong"):
        parse_behaviour(text, "x")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "x, line 1: the file: "),
        ("- 1\n", "x, line 1: the file: "),
        ("language: en\nlanguages: {en: [\n", "x, line 3: not YAML: "),
        ("language: en\nlanguage: de\n", "x, line 2: not YAML: language stands here twice"),
        ("language: \x00\n", "x.*: not YAML: "),
        ("a: !!python/object:os.system {}\n", "x, line 1: not YAML: could not determine a constructor"),
    ],
)
def test_what_is_no_behaviour_is_told(text: str, said: str) -> None:
    with pytest.raises(BehaviourError, match=said) as caught:
        parse_behaviour(text, "x")
    assert "\n" not in caught.value.message


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(BehaviourError, match="can't be read: No such file"):
        read_behaviour(tmp_path / "none.yaml")
    (tmp_path / "bytes.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BehaviourError, match="is not text in UTF-8"):
        read_behaviour(tmp_path / "bytes.yaml")
