"""The calibration of a session: one at a time, from a pose that a body holds from its next frame on."""

from collections.abc import Container

from fervor.errors import InputError
from fervor.protocol.messages import SessionCalibrate, SessionCalibrated
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor.session.calibrating import Calibrating
from fervor.session.events import Pose, Source, Ticket
from fervor.skeletons.calibration import Calibration


class Calibrator:
    """Which body holds a pose, if any does."""

    __slots__ = ("under_way",)

    def __init__(self) -> None:
        self.under_way: Calibrating | None = None
        """The one that is; None where none is."""

    def begin(self, request: SessionCalibrate, source: Source) -> None:
        """Begin anew; raises InputError where the source can't be calibrated."""
        self.under_way = Calibrating.begin(request, source)

    def holds(self, body: str) -> bool:
        """Whether this body holds its pose, of which a checkpoint would know nothing."""
        return self.under_way is not None and self.under_way.request.body == body

    def add(self, ticket: Ticket, pose: Pose) -> tuple[Calibration, SessionCalibrated] | None:
        """Take a frame; what was found, and how it is told, once the pose was held long enough.

        Raises:
            InputError: it was not held still; the calibration is over.
        """
        if self.under_way is None or not self.holds(ticket.body) or {"late", "duplicate"} & set(ticket.flags):
            return None  # late and duplicate frames change nothing
        name = self.under_way.request.name
        try:
            found = self.under_way.add(ticket.time, pose)
        except InputError:
            self.under_way = None
            raise
        if found is None:
            return None
        self.under_way = None
        skeleton = SkeletonSpec.of(found.skeleton, name=name)
        told = SessionCalibrated(
            skeleton=skeleton, frames=found.frames, spread_deg=found.spread_deg, unseen=found.unseen
        )
        return found, told

    def gone(self, body: str) -> InputError | None:
        """A body is gone, and with it the calibration that its pose was held for; one that waits for it goes on to."""
        if self.under_way is None or not self.under_way.begun or not self.holds(body):
            return None
        self.under_way = None
        return InputError(f"body {body!r} was gone before its pose was held long enough; nothing changed")

    def replaced(self, newcomer: str, bodies: Container[str]) -> tuple[str, InputError | None]:
        """A newcomer takes the place of bodies that were idle, its own former self among them: whose, and as `gone`."""
        held = newcomer if self.under_way is None else self.under_way.request.body
        return held, self.gone(held) if held == newcomer or held not in bodies else None
