"""The questionnaire form: written empty, filled in by people and programs, and read with every fault told."""

from pathlib import Path

import pytest

from fervor.errors import DataError, InputError
from fervor_pepper.study.answers import FILE, Question, add_answers, read_answers, write_template

HEAD = "participant,condition,scale,item,answer\n"


def written(folder: Path, text: str) -> Path:
    (folder / FILE).write_text(text, encoding="utf-8")
    return folder


def test_an_empty_form_asks_everything_in_an_order_that_turns(tmp_path: Path) -> None:
    path = write_template(tmp_path / "new", ["P01", "P02", "P03"], ["none", "label", "full"], {"warm": 2, "smart": 1})
    lines = path.read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + 3 * 3 * 3
    assert lines[1:4] == ["P01,none,warm,1,", "P01,none,warm,2,", "P01,none,smart,1,"]
    first = [next(line for line in lines if line.startswith(person)).split(",")[1] for person in ("P01", "P02", "P03")]
    assert first == ["none", "label", "full"]
    answers, odd = read_answers(tmp_path / "new")
    assert (set(answers.values()), odd) == ({None}, [])


def test_answers_are_added_and_the_last_one_counts(tmp_path: Path) -> None:
    question = Question("P01", "none", "warm")
    write_template(tmp_path, ["P01"], ["none", "full"], {"warm": 1})
    add_answers(tmp_path, [(question, 3)])
    add_answers(tmp_path, [(question, 5), (Question("P01", "full", "warm"), 6)])
    answers, odd = read_answers(tmp_path)
    assert (answers[question], answers[Question("P01", "full", "warm")]) == (5, 6)
    assert odd == ["warm 1 of P01 in none is answered twice; line 5 counts"]


def test_a_form_from_a_spreadsheet(tmp_path: Path) -> None:
    text = "\ufeff" + (HEAD + "P01,none,warm,,4\n\nP02,none,warm,1,\n").replace(",", ";").replace("\n", "\r\n")
    answers, _ = read_answers(written(tmp_path, text))
    assert answers == {Question("P01", "none", "warm"): 4, Question("P02", "none", "warm"): None}


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("P01,none,warm,1,8", "line 2: warm is answered by '8'; expected a whole number from 1 to 7"),
        ("P01,none,warm,1,0", "line 2: warm is answered by '0'"),
        ("P01,none,warm,1,4.5", "line 2: warm is answered by '4.5'"),
        ("P01,none,warm,1,yes", "line 2: warm is answered by 'yes'"),
        ("Ann Smith,none,warm,1,4", "line 2: participant 'Ann Smith' is not a code"),
        (",none,warm,1,4", "line 2: participant is empty"),
        ("P01,,warm,1,4", "line 2: condition is empty"),
        ("P01,none,,1,4", "line 2: scale is empty"),
    ],
)
def test_a_row_that_is_wrong_is_told(tmp_path: Path, row: str, said: str) -> None:
    with pytest.raises(DataError) as caught:
        read_answers(written(tmp_path, HEAD + row + "\n"))
    assert said in caught.value.message
    assert "\n" not in caught.value.message


def test_a_form_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="is missing; `fervor study template` writes an empty one"):
        read_answers(tmp_path)
    with pytest.raises(DataError, match="has no column answer; expected participant, condition"):
        read_answers(written(tmp_path, "participant,condition,scale,item\n"))
    (tmp_path / FILE).write_bytes(b"\xff\xfe")
    with pytest.raises(DataError, match="can't be read"):
        read_answers(tmp_path)


def test_what_cannot_be_written_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected a whole number from 1 to 7"):
        add_answers(tmp_path / "new", [(Question("P01", "none", "warm"), 4), (Question("P01", "none", "smart"), 9)])
    with pytest.raises(InputError, match="is not a code"):
        add_answers(tmp_path / "new", [(Question("Ann Smith", "none", "warm"), 4)])
    with pytest.raises(InputError, match="expected at least two"):
        write_template(tmp_path / "new", ["P01"], ["none", "none"], {"warm": 1})
    assert not (tmp_path / "new").exists()
    write_template(tmp_path / "new", ["P01"], ["none", "full"], {"warm": 1})
    with pytest.raises(DataError, match="is there already"):
        write_template(tmp_path / "new", ["P01"], ["none", "full"], {"warm": 1})
    (tmp_path / "file").touch()
    with pytest.raises(DataError, match="can't be made"):
        add_answers(tmp_path / "file", [(Question("P01", "none", "warm"), 4)])
