"""Who shows what: labels of faces and persons find the body they belong to, as REP-155 joins them.

Rules. A body's person is the one whose `body_id` it is. The person's label is the newest of its own expression and of
its face's. Where no person is known and there is one face and one body only, they belong together (`pair_alone`). A
label holds for `ttl` from its own stamp on; after that, and where none came, the label is the one of the settings. An
expression that was overtaken on its way is passed over.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

from fervor_ros.pose import STEP_BACK_NS, Stamp


@dataclass(frozen=True, slots=True)
class Label:
    """An emotion that was told."""

    emotion: str
    stamp: Stamp


@dataclass(slots=True)
class _Person:
    body: str = ""
    face: str = ""
    label: Label | None = None


@dataclass(slots=True)
class People:
    """Persons and faces, as far as labels go."""

    fallback: str
    """The emotion where none was told."""
    ttl_ns: int | None
    """How long a label holds; None: until the next."""
    pair_alone: bool = True
    _persons: dict[str, _Person] = field(default_factory=dict)
    _faces: frozenset[str] = frozenset()
    _labels: dict[str, Label] = field(default_factory=dict)
    """Of faces."""

    def persons(self, ids: Iterable[str]) -> None:
        """These persons are tracked, and no others."""
        self._persons = {person: self._persons.get(person, _Person()) for person in ids}
        self._forget()

    def faces(self, ids: Iterable[str]) -> None:
        """These faces are tracked, and no others; one that is gone still counts where a person has it."""
        self._faces = frozenset(ids)
        self._forget()

    def match_body(self, person: str, body: str) -> None:
        """A person's body; empty: none."""
        if person in self._persons:
            self._persons[person].body = body

    def match_face(self, person: str, face: str) -> None:
        """A person's face; empty: none."""
        if person in self._persons:
            self._persons[person].face = face
            self._forget()

    def face_shows(self, face: str, label: Label) -> None:
        """A face has an expression."""
        if face in self.known_faces:
            self._labels[face] = _follow(self._labels.get(face), label)

    def person_shows(self, person: str, label: Label) -> None:
        """A person has an expression, whatever it was told from."""
        known = self._persons.get(person)
        if known is not None:
            known.label = _follow(known.label, label)

    @property
    def known_persons(self) -> frozenset[str]:
        """Ids of the persons."""
        return frozenset(self._persons)

    @property
    def known_faces(self) -> frozenset[str]:
        """Ids of the faces whose expressions matter."""
        return self._faces | {person.face for person in self._persons.values() if person.face}

    def person_of(self, body: str) -> str:
        """The person whose body it is; empty: not known."""
        return next((name for name, person in self._persons.items() if person.body == body), "")

    def emotion_of(self, body: str, bodies: int, now: Stamp) -> str:
        """The label in force for a body.

        Args:
            body: the id.
            bodies: how many there are.
            now: stamp of its pose.
        """
        label = self._label(body, bodies)
        if label is None or (self.ttl_ns is not None and abs(now - label.stamp) > self.ttl_ns):
            return self.fallback
        return label.emotion

    def _label(self, body: str, bodies: int) -> Label | None:
        name = self.person_of(body)
        if name:
            person = self._persons[name]
            return _newest(person.label, self._labels.get(person.face))
        alone = self.pair_alone and not self._persons and bodies == 1 and len(self._faces) == 1
        return self._labels.get(next(iter(self._faces))) if alone else None

    def _forget(self) -> None:
        """Drop the labels of faces that matter no more."""
        known = self.known_faces
        self._labels = {face: label for face, label in self._labels.items() if face in known}


def _follow(known: Label | None, label: Label) -> Label:
    """The label that counts when another one comes."""
    late = known is not None and 0 < known.stamp - label.stamp <= STEP_BACK_NS
    return known if known is not None and late else label


def _newest(known: Label | None, label: Label | None) -> Label | None:
    """The newer of two."""
    if known is None or label is None:
        return known or label
    return label if label.stamp >= known.stamp else known
