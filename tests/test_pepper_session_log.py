"""The field-test recorder: rows for all that happens, added to what is there, whole after a crash."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest

from fervor.errors import DataError, InputError
from fervor.levels import Level
from fervor_pepper.acts import Act, Voice
from fervor_pepper.robot import RobotError
from fervor_pepper.session_log import COLUMNS, KINDS, SessionLog
from fervor_pepper.stage import Outcome
from shows import estimate

ACT = Act(3, Voice("en", "English"), say="you look, so happy!", emotion="joy", level=Level.WEAK, body="7")


def log(path: Path, **codes: str) -> SessionLog:
    return SessionLog(path, **({"participant": "P01", "condition": "none"} | codes), clock=iter(range(99)).__next__)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_kind_of_row(tmp_path: Path) -> None:
    path = tmp_path / "s.csv"
    written = log(path)
    written.begin("mode none")
    written.estimate(estimate(body="7", seq=4, t=1.25, flags=("held", "jump")))
    written.estimate(estimate(level=None, intensity=None, status="warming_up"))
    written.act(ACT)
    written.outcome(Outcome(ACT))
    written.outcome(Outcome(ACT, error=RobotError("no voice")))
    written.left("7")
    written.lost("the service is gone")
    written.end()
    found = rows(path)
    assert {row["kind"] for row in found} == set(KINDS)
    assert {(row["participant"], row["condition"]) for row in found} == {("P01", "none")}
    seconds = [float(row["seconds"]) for row in found]
    assert seconds == sorted(seconds)
    told = {name: cell for name, cell in found[1].items() if cell and name not in ("time", "seconds")}
    assert told == {
        "participant": "P01", "condition": "none", "kind": "estimate", "body": "7", "seq": "4", "t": "1.250",
        "emotion": "joy", "level": "weak", "intensity": "0.3000", "status": "ok", "flags": "held jump",
    }  # fmt: skip
    assert (found[2]["level"], found[2]["intensity"]) == ("", "")
    assert (found[4]["said"], found[4]["act"], found[5]["said"], found[5]["detail"]) == (ACT.say, "3", "", "no voice")


def test_sessions_are_added_under_one_head(tmp_path: Path) -> None:
    path = tmp_path / "s.csv"
    for participant in ("P01", "P02"):
        written = log(path, participant=participant)
        written.begin("")
        written.end()
    assert [row["participant"] for row in rows(path)] == ["P01", "P01", "P02", "P02"]


def test_a_row_that_a_crash_cut_off_harms_no_other(tmp_path: Path) -> None:
    path = tmp_path / "s.csv"
    first = log(path)
    first.begin("")
    first.close()
    path.write_bytes(path.read_bytes()[:-20])
    second = log(path)
    second.begin("again")
    second.end()
    assert [row["detail"] for row in rows(path)[1:]] == ["again", ""]


def test_a_killed_program_has_written_everything(tmp_path: Path) -> None:
    path = tmp_path / "s.csv"
    program = (
        "import os, pathlib, sys\n"
        "from fervor_pepper.session_log import SessionLog\n"
        "log = SessionLog(pathlib.Path(sys.argv[1]), participant='P01', condition='none')\n"
        "log.begin('x')\n"
        "log.left('7')\n"
        "os.kill(os.getpid(), 9)\n"
    )
    subprocess.run([sys.executable, "-c", program, str(path)], check=False, timeout=60)
    assert [row["kind"] for row in rows(path)] == ["begin", "left"]


@pytest.mark.parametrize("code", ["Ann Smith", "ann@robot.local", "", "P" * 17, "Zoë"])
def test_names_are_no_codes(tmp_path: Path, code: str) -> None:
    with pytest.raises(InputError, match="is not a code; expected 1 to 16 letters"):
        log(tmp_path / "s.csv", participant=code)
    assert not (tmp_path / "s.csv").exists()


def test_a_file_of_another_kind_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "other.csv"
    path.write_text("a,b\n1,2\n")
    with pytest.raises(DataError, match="has the columns a, b; expected time, seconds"):
        log(path)
    assert path.read_text() == "a,b\n1,2\n"
    with pytest.raises(DataError, match="can't be written"):
        log(tmp_path / "none" / "s.csv")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no full device")
def test_a_full_disk_ends_the_log_and_not_the_session(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with pytest.raises(DataError, match="/dev/full: can't be written: No space left"):
        log(Path("/dev/full"))
    written = log(tmp_path / "s.csv")
    written.begin("")
    assert written._rows is not None
    written._rows.close()
    with Path("/dev/full").open("ab", buffering=0) as full:
        written._rows._file = full  # the disk is full from now on
        written.left("7")
        written.left("8")
    assert caplog.text.count("can't be written any more: No space left") == 1


def test_columns_say_who_and_when_first() -> None:
    assert COLUMNS[:5] == ("time", "seconds", "participant", "condition", "kind")
