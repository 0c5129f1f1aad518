"""Which calibration an answer belongs to, where several were asked for."""

import pytest

from fervor.errors import InputError
from fervor.protocol.messages import SessionCalibrate, SessionCalibrated
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor_client.calibrations import Calibrations
from fervor_client.track import Entry

FOUND = SessionCalibrated(
    skeleton=SkeletonSpec(name="x", joints=("a",), parents=(-1,), segments={"pelvis": "a"}),
    frames=7,
    spread_deg=1.0,
    unseen=(),
)


class Asking:
    """Requests, each with an entry of its own, and frames."""

    def __init__(self, *, timed: bool = True) -> None:
        self.calibrations = Calibrations(timed=timed)
        self._count = 0

    def ask(self, body: str, seconds: float = 0.5) -> int:
        self._count += 1
        return self.calibrations.ask(SessionCalibrate(body=body, seconds=seconds), Entry(self._count, "asked"))

    def frames(self, body: str, *times: float) -> None:
        for time in times:
            self.calibrations.sent((body, round(1000 * time)), time)

    @property
    def places(self) -> list[int]:
        """Of those that wait."""
        return [entry.place for entry in self.calibrations.entries]


@pytest.fixture
def asking() -> Asking:
    return Asking()


def replaced(asking: Asking, number: int) -> bool:
    with pytest.raises(InputError, match="another calibration took the place of this one"):
        asking.calibrations.take(number)
    return True


def test_the_first_answer_is_the_oldest_ones_where_its_frames_were_enough(asking: Asking):
    first = asking.ask("ann")
    asking.frames("ann", 0.0, 0.3, 0.5)
    second = asking.ask("bob")
    assert asking.places == [1, 2]
    asking.calibrations.calibrated(FOUND)
    assert asking.calibrations.take(first) == FOUND
    assert asking.calibrations.take(second) is None
    assert asking.places == [2]


@pytest.mark.parametrize("times", [(), (0.0,), (0.0, 0.4)])
def test_one_whose_frames_were_too_few_is_replaced_at_once(asking: Asking, times: tuple[float, ...]):
    first = asking.ask("ann")
    asking.frames("ann", *times)
    asking.frames("bob", 0.0, 9.0)
    second = asking.ask("ann")
    assert replaced(asking, first)
    asking.calibrations.calibrated(FOUND)
    assert asking.calibrations.take(second) == FOUND


def test_an_estimate_of_a_later_frame_tells_that_one_was_replaced_after_all(asking: Asking):
    """The service may have left out one of the frames that seemed enough."""
    first = asking.ask("ann")
    asking.frames("ann", 0.0, 0.5)
    second = asking.ask("ann")
    asking.frames("bob", 0.6)
    asking.calibrations.estimated(("ann", 500))
    assert asking.places == [1, 2]
    asking.calibrations.estimated(("bob", 600))
    assert asking.places == [2]
    assert replaced(asking, first)
    asking.calibrations.calibrated(FOUND)
    assert asking.calibrations.take(second) == FOUND


def test_that_is_so_too_where_the_later_one_was_replaced_itself(asking: Asking):
    first = asking.ask("ann")
    asking.frames("ann", 0.0, 0.5)
    asking.ask("bob")
    asking.frames("bob", 0.6)
    asking.ask("cyd")
    assert asking.places == [1, 2, 3], "the second is asked again, lest the first be answered after all"
    asking.calibrations.estimated(("bob", 600))
    assert replaced(asking, first)
    assert asking.places == [3]


def test_a_failure_is_of_the_body_that_it_names(asking: Asking):
    first = asking.ask("ann")
    asking.frames("ann", 0.0, 0.5)
    second = asking.ask("bob")
    assert asking.calibrations.failed("bob", InputError("bob moved"))
    with pytest.raises(InputError, match="bob moved"):
        asking.calibrations.take(second)
    asking.calibrations.calibrated(FOUND)
    assert asking.calibrations.take(first) == FOUND
    assert not asking.calibrations.failed("ann", InputError("not of any"))


def test_a_request_that_makes_no_sense_is_the_newest(asking: Asking):
    asking.ask("ann")
    asking.frames("ann", 0.0, 0.5)
    second = asking.ask("bob")
    assert asking.calibrations.failed(None, InputError("no such way to face"))
    with pytest.raises(InputError, match="no such way"):
        asking.calibrations.take(second)
    assert asking.places == [1]


def test_a_body_that_is_gone_fails_what_it_has_begun(asking: Asking):
    asking.ask("ann")
    asking.calibrations.gone("ann")
    assert not asking.calibrations.decided, "its next life may hold the pose"
    asking.frames("ann", 0.0)
    asking.calibrations.gone("ann")
    assert asking.calibrations.decided
    asking.ask("bob")
    assert asking.calibrations.holds("ann"), "its failure is on the way"


def test_without_times_any_frame_may_have_been_enough():
    asking = Asking(timed=False)
    asking.ask("ann")
    assert not asking.calibrations.decided
    asking.frames("ann", 0.0)
    assert asking.calibrations.decided


def test_nothing_grows_while_one_waits_for_a_body_that_never_comes(asking: Asking):
    asking.ask("nobody")
    asking.frames("ann", *range(1000))
    assert not asking.calibrations._asked[0].since
