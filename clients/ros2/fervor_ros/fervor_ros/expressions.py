"""What `hri_msgs/Expression` says, in the words of the model."""

from collections.abc import Mapping

from fervor.emotions import EMOTIONS, SYNONYMS, UNKNOWN

EXPRESSIONS: Mapping[str, str] = {
    "neutral": "neutral",
    "angry": "anger",
    "sad": "sadness",
    "happy": "joy",
    "surprised": "surprise",
    "disgusted": "disgust",
    "scared": "fear",
    "despaired": "sadness",
    "guilty": "shame",
    "disappointed": "sadness",
    "embarrassed": "shame",
    "horrified": "fear",
    "annoyed": "anger",
    "furious": "anger",
    "amazed": "surprise",
    "excited": "joy",
}
"""Expressions that are one of the model's emotions, or a shade of one; the others of the message have none."""


def emotion_of(expression: str) -> str:
    """The emotion of an expression: one of the message's, or a name that fervor knows; else "unknown"."""
    name = expression.strip().lower()
    if name in EMOTIONS:
        return name
    return EXPRESSIONS.get(name) or SYNONYMS.get(name, UNKNOWN)
