"""Questionnaire answers of a field test, as a CSV form that people fill in and programs add to.

Rules. One row an answer; a row without one is a question not answered yet. Rows are only appended: of several for the
same question the last counts. People are codes. Columns: docs/reference/pepper.md.
"""

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fervor.errors import DataError, InputError
from fervor_pepper.session_log import Appender, check_code

FILE = "answers.csv"
"""Name of the form in a study's folder."""

COLUMNS = ("participant", "condition", "scale", "item", "answer")

LEAST, MOST = 1, 7
"""Ends of the scales."""


@dataclass(frozen=True, slots=True)
class Question:
    """What one participant is asked after one condition."""

    participant: str
    condition: str
    scale: str
    item: str = "1"
    """Of the scale; its answers are averaged."""


Answers = Mapping[Question, int | None]
"""All questions of a form in its order; None where there is no answer."""


def read_answers(folder: Path) -> tuple[Answers, list[str]]:
    """The answers in a study's folder, and what is odd about them, each in a sentence.

    Raises:
        DataError: there is no form, or a row of it can't be used; says in which line.
    """
    path = folder / FILE
    answers: dict[Question, int | None] = {}
    odd = []
    for line, cells in _rows(path):
        question, answer = _row(f"{path}, line {line}", cells)
        if answer is not None and answers.get(question) not in (None, answer):
            told = f"{question.scale} {question.item} of {question.participant} in {question.condition}"
            odd.append(f"{told} is answered twice; line {line} counts")
        if answer is not None or question not in answers:
            answers[question] = answer
    return answers, odd


def add_answers(folder: Path, answers: Iterable[tuple[Question, int]]) -> Path:
    """Append answers to a study's form, which is made where there is none.

    Raises:
        InputError: a participant that is no code, or an answer off the scale.
        DataError: the form can't be written.
    """
    checked = [(question, _on_scale(f"{question.scale}", str(answer))) for question, answer in answers]
    for question, _ in checked:
        check_code(question.participant)
    _append(folder, checked)
    return folder / FILE


def write_template(
    folder: Path, participants: Sequence[str], conditions: Sequence[str], scales: Mapping[str, int]
) -> Path:
    """Write an empty form: every question of every participant.

    Conditions come in an order that turns from participant to participant, in which to take them.

    Args:
        folder: of the study, made where there is none.
        participants: codes.
        conditions: names, at least two.
        scales: name and number of items of each.

    Raises:
        InputError: a code that is none, or too few conditions.
        DataError: there is a form already, or it can't be written.
    """
    if len(set(conditions)) < 2:
        raise InputError("a study compares conditions; expected at least two")
    if (folder / FILE).exists():
        raise DataError(f"{folder / FILE} is there already; expected a folder without a form")
    for participant in participants:
        check_code(participant)
    for condition in conditions:
        check_code(condition, "condition")
    questions = [
        Question(participant, conditions[(number + place) % len(conditions)], scale, str(item))
        for number, participant in enumerate(participants)
        for place in range(len(conditions))
        for scale, items in scales.items()
        for item in range(1, items + 1)
    ]
    _append(folder, [(question, None) for question in questions])
    return folder / FILE


def _append(folder: Path, answers: Iterable[tuple[Question, int | None]]) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"{folder}: can't be made: {error.strerror or error}") from None
    rows = Appender(folder / FILE, COLUMNS)
    try:
        for question, answer in answers:
            cells = (question.participant, question.condition, question.scale, question.item)
            rows.append((*cells, "" if answer is None else answer))
    finally:
        rows.close()


def _rows(path: Path) -> Iterator[tuple[int, Mapping[str, str]]]:
    """Line number and cells of each row; spreadsheets write semicolons in some countries."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise DataError(f"{path} is missing; `fervor study template` writes an empty one") from None
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{path}: can't be read: {error}") from None
    head = text.partition("\n")[0]
    table = csv.DictReader(text.splitlines(), delimiter=";" if head.count(";") > head.count(",") else ",")
    missing = [column for column in COLUMNS if column not in (table.fieldnames or ())]
    if missing:
        raise DataError(f"{path}: has no column {missing[0]}; expected {', '.join(COLUMNS)}")
    for row in table:
        cells = {column: (row[column] or "").strip() for column in COLUMNS}
        if any(cells.values()):
            yield table.line_num, cells


def _row(where: str, cells: Mapping[str, str]) -> tuple[Question, int | None]:
    for column in ("participant", "condition", "scale"):
        if not cells[column]:
            raise DataError(f"{where}: {column} is empty; expected a name for it")
    try:
        check_code(cells["participant"])
        answer = _on_scale(cells["scale"], cells["answer"]) if cells["answer"] else None
    except InputError as error:
        raise DataError(f"{where}: {error.message}") from None
    return Question(cells["participant"], cells["condition"], cells["scale"], cells["item"] or "1"), answer


def _on_scale(scale: str, said: str) -> int:
    if said.isdecimal() and LEAST <= int(said) <= MOST:
        return int(said)
    raise InputError(f"{scale} is answered by {said!r}; expected a whole number from {LEAST} to {MOST}")
