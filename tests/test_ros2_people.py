"""Whose label it is: faces and persons find their body, and labels end."""

import pytest

from fervor.emotions import EMOTIONS, UNKNOWN
from fervor_ros.expressions import EXPRESSIONS, emotion_of
from fervor_ros.people import Label, People

S = 1_000_000_000


def people(**changes) -> People:
    return People(**{"fallback": UNKNOWN, "ttl_ns": 2 * S, **changes})


def met(known: People) -> People:
    """Anna has body b1 and face f1, Ben has body b2 and no face."""
    known.persons(["anna", "ben"])
    known.faces(["f1", "f9"])
    known.match_body("anna", "b1")
    known.match_body("ben", "b2")
    known.match_face("anna", "f1")
    return known


def test_a_face_speaks_for_the_body_of_its_person() -> None:
    known = met(people())
    known.face_shows("f1", Label("joy", 10 * S))
    known.face_shows("f9", Label("fear", 10 * S))
    assert known.person_of("b1") == "anna"
    assert known.emotion_of("b1", 2, 11 * S) == "joy"
    assert known.emotion_of("b2", 2, 11 * S) == UNKNOWN
    assert known.emotion_of("b3", 2, 11 * S) == UNKNOWN


def test_of_face_and_person_the_newest_counts() -> None:
    known = met(people())
    known.face_shows("f1", Label("joy", 10 * S))
    known.person_shows("anna", Label("sadness", 11 * S))
    assert known.emotion_of("b1", 2, 11 * S) == "sadness"
    known.face_shows("f1", Label("surprise", 12 * S))
    known.face_shows("f1", Label("anger", 11 * S))  # overtaken on its way
    assert known.emotion_of("b1", 2, 12 * S) == "surprise"


def test_a_bag_that_begins_anew_takes_no_labels_of_its_end_along() -> None:
    known = met(people())
    known.face_shows("f1", Label("joy", 60 * S))
    assert known.emotion_of("b1", 2, 60 * S) == "joy"
    assert known.emotion_of("b1", 2, 10 * S) == UNKNOWN
    known.face_shows("f1", Label("fear", 11 * S))
    assert known.emotion_of("b1", 2, 11 * S) == "fear"


def test_a_label_ends_by_its_stamp() -> None:
    known = met(people(fallback="neutral"))
    known.face_shows("f1", Label("joy", 10 * S))
    assert known.emotion_of("b1", 2, 12 * S) == "joy"
    assert known.emotion_of("b1", 2, 12 * S + 1) == "neutral"
    lasting = met(people(ttl_ns=None))
    lasting.face_shows("f1", Label("joy", 10 * S))
    assert lasting.emotion_of("b1", 2, 10_000 * S) == "joy"


def test_a_tracker_that_changes_its_mind_keeps_the_label() -> None:
    known = met(people())
    known.face_shows("f1", Label("joy", 10 * S))
    known.match_body("anna", "b7")
    assert known.emotion_of("b7", 2, 11 * S) == "joy"
    assert known.emotion_of("b1", 2, 11 * S) == UNKNOWN
    known.match_face("anna", "")
    assert known.emotion_of("b7", 2, 11 * S) == UNKNOWN


def test_a_face_that_its_person_has_lost_still_counts_until_its_label_ends() -> None:
    known = met(people())
    known.face_shows("f1", Label("joy", 10 * S))
    known.faces([])
    assert known.known_faces == {"f1"}
    assert known.emotion_of("b1", 1, 11 * S) == "joy"
    known.persons(["ben"])
    assert known.known_faces == frozenset()
    assert known.emotion_of("b1", 1, 11 * S) == UNKNOWN


@pytest.mark.parametrize(
    ("faces", "bodies", "persons", "alone", "expected"),
    [
        (["f1"], 1, [], True, "joy"),
        (["f1"], 1, [], False, UNKNOWN),
        (["f1", "f2"], 1, [], True, UNKNOWN),
        (["f1"], 2, [], True, UNKNOWN),
        (["f1"], 1, ["anna"], True, UNKNOWN),
    ],
)
def test_one_face_and_one_body_belong_together(
    faces: list[str], bodies: int, persons: list[str], alone: bool, expected: str
) -> None:
    known = people(pair_alone=alone)
    known.persons(persons)
    known.faces(faces)
    known.face_shows("f1", Label("joy", 10 * S))
    assert known.emotion_of("b1", bodies, 10 * S) == expected


def test_strangers_say_nothing() -> None:
    known = people()
    known.face_shows("f1", Label("joy", S))
    known.person_shows("anna", Label("joy", S))
    known.match_body("anna", "b1")
    known.match_face("anna", "f1")
    assert not known.known_faces
    assert known.person_of("b1") == ""


def test_expressions_are_emotions_of_the_model() -> None:
    assert set(EXPRESSIONS.values()) <= set(EMOTIONS)
    assert [emotion_of(name) for name in ("happy", "Scared ", "pride", "proud", "asleep", "")] == [
        "joy", "fear", "pride", "pride", UNKNOWN, UNKNOWN
    ]  # fmt: skip
