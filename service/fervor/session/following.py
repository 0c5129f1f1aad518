"""What a started session follows: frames become tickets, and outcomes answers, in the order in which the frames came.

A ticket is under way from the frame that it was planned for until its outcome. Frames that find nothing under way, as
nearly all do, may be taken promptly (`prompt`, `answer`), without a record of what is under way; what comes of them is
the same.
"""

import math
from collections.abc import Iterable, Mapping, MutableMapping, Sequence

from fervor.emotions import emotion_vector
from fervor.errors import EngineError, FervorError, FrameError, InputError
from fervor.protocol.lean_estimate import LeanEstimate, LeanEstimates
from fervor.protocol.lean_frame import LeanFrame, LeanFrames
from fervor.protocol.messages import (
    Error,
    Frame,
    Resumed,
    SessionCalibrate,
    SessionCalibrated,
)
from fervor.session.body import Body
from fervor.session.calibrator import Calibrator
from fervor.session.events import Event, Outcome, Pose, Release, Reply, Restore, Said, Ticket
from fervor.session.groups import Groups
from fervor.session.host import Host
from fervor.session.issuer import Issuer
from fervor.session.poses import Read
from fervor.session.refusal import refusal
from fervor.session.roster import Roster
from fervor.session.start import Agreement
from fervor.session.under_way import UnderWay

AnyFrame = Frame | LeanFrame

MOST_PROMPT = 8
"""Frames of a message that are taken promptly; the steps of more, one after the other, would hold up everybody."""


class Following:
    """The bodies of one session, and what is under way for them."""

    def __init__(self, agreement: Agreement, host: Host, counts: MutableMapping[str, int]) -> None:
        """Nobody yet.

        Args:
            agreement: of the session.
            host: the service.
            counts: the fields of `Totals`, counted up here.
        """
        idle_s = math.inf if agreement.terms.clock == "frames" else host.limits.body_idle_s
        self.agreement = agreement
        self._host = host
        self._counts = counts
        self._issuer = Issuer(host, agreement)
        self._roster = Roster(host.claim, most=host.limits.max_bodies, idle_s=idle_s)
        self._under_way = UnderWay()
        self._groups = Groups()
        self._calibrator = Calibrator()
        self._calibrated: dict[Ticket, int] = {}  # last frame of a calibration → the group that tells of it

    @property
    def bodies(self) -> Iterable[Body]:
        """In the order in which they came."""
        return self._roster

    @property
    def busy(self) -> bool:
        """Whether something is under way."""
        return bool(self._under_way.tickets)

    # --- frames -------------------------------------------------------------------------------------------------------

    def frame(
        self,
        frame: AnyFrame,
        read: Read | None = None,
        group: int | None = None,
        place: int = 0,
        *,
        keep: bool = True,
    ) -> list[Event]:
        """The work of one frame. A bad one is told and leaves no trace.

        Args:
            frame: as it came.
            read: its pose, where it was read already.
            group: of the message, if it has several.
            place: in it.
            keep: whether a checkpoint may go with it.
        """
        try:
            events = self._plan(frame, read, group, place, keep=keep)
        except FervorError as error:
            self._counts["rejected"] += 1
            events = [Reply(refusal(error, frame))]
        return [*self._roster.give_up_spare(), *events] if self._roster.spare else events

    def frames(self, frames: Sequence[AnyFrame], poses: Sequence[Read]) -> list[Event]:
        """The work of a message of several.

        Raises:
            FrameError: they are more than the service takes.
        """
        most = self._host.limits.max_frames_per_message
        if len(frames) > most:
            raise FrameError(f"a message has {len(frames)} frames; this service takes at most {most}")
        group, agreement = self._groups.open(), self.agreement
        events: list[Event] = []
        last = _last_of_bodies(frames)
        for place, frame in enumerate(frames):
            events += self.frame(frame, poses[place] if poses else None, group, place, keep=place in last)
        if self.agreement is not agreement:  # calibrated: the rest of the message is answered before that is told
            events += self.checkpoints(group)
        return events + self._close_group(group)

    def _plan(self, frame: AnyFrame, read: Read | None, group: int | None, place: int, *, keep: bool) -> list[Event]:
        agreement, host, calibrator, name = self.agreement, self._host, self._calibrator, frame.body
        time = agreement.time_of(frame) if frame.t is None else frame.t
        pose = agreement.pose_of(_plain(frame)) if read is None else read
        if isinstance(pose, FrameError):
            raise pose
        body = self._roster.find(name, time)
        if body is not None and frame.seq <= body.newest_seq and (answer := body.answered(frame.seq)) is not None:
            return self._answer_again(answer, group, place)
        if frame.emotion is not None:
            emotion_vector(frame.emotion)  # before a body is opened for it: a bad frame leaves no trace
        gone: list[Event] = []
        if body is None:
            body = self._roster.seen(name, time, agreement.terms, lambda: agreement.first_label(time))
            gone = _replies(calibrator.replaced(name, self._roster))
        if host.spread is not None:
            host.spread.note()
        ticket = body.plan(
            frame.seq,
            time,
            pose,
            emotion=frame.emotion,
            group=group,
            keep=keep and not calibrator.holds(name),
            spread=host.spread,
        )
        self._under_way.add(ticket, body, place)
        if group is not None:
            self._groups.expect(group)
        self._note(ticket)
        return [*gone, ticket, *self._calibrate(ticket, pose)] if gone or calibrator.under_way else [ticket]

    def _answer_again(self, answer: LeanEstimate, group: int | None, place: int) -> list[Event]:
        self._counts["duplicate"] += 1
        if group is None:
            return [Reply(answer)]
        self._groups.put(group, place, answer)
        return []

    def _note(self, ticket: Ticket) -> None:
        self._counts["frames"] += 1
        if not ticket.flags:
            return
        self._counts["late"] += "late" in ticket.flags
        self._counts["duplicate"] += "duplicate" in ticket.flags
        self._counts["resets"] += "gap_reset" in ticket.flags or "clock_reset" in ticket.flags

    # --- frames that find nothing under way ---------------------------------------------------------------------------

    def prompt(self, message: LeanFrame | LeanFrames, poses: Sequence[Read]) -> Sequence[Ticket]:
        """The tickets of frames about which nothing is unusual; none, having done nothing, where something is.

        For a caller that runs them, and hands their outcomes to `answer`, before anything else of this session.
        """
        if self._under_way.tickets or self._calibrator.under_way is not None or self._roster.spare:
            return ()
        if isinstance(message, LeanFrame):
            body = self._usual(message, poses[0])
            return () if body is None else (self._plan_usual(message, poses[0], body, None, keep=True),)
        if len(message.frames) > min(MOST_PROMPT, self._host.limits.max_frames_per_message):
            return ()
        newest: dict[str, int] = {}
        bodies = []
        for frame, pose in zip(message.frames, poses, strict=True):
            body = self._usual(frame, pose)
            if body is None or frame.seq <= newest.get(frame.body, -1):
                return ()
            newest[frame.body] = frame.seq
            bodies.append(body)
        last = _last_of_bodies(message.frames)
        together = enumerate(zip(message.frames, poses, bodies, strict=True))
        return [self._plan_usual(frame, pose, body, 0, keep=place in last) for place, (frame, pose, body) in together]

    def _usual(self, frame: LeanFrame, read: Read) -> Body | None:
        """The body of a frame, where both are as they mostly are."""
        if frame.t is None or isinstance(read, FrameError):
            return None
        if frame.emotion is not None and not _is_known(frame.emotion):
            return None
        body = self._roster.find(frame.body, frame.t)
        return None if body is None or frame.seq <= body.newest_seq else body

    def _plan_usual(self, frame: LeanFrame, pose: Read, body: Body, group: int | None, *, keep: bool) -> Ticket:
        spread = self._host.spread
        if spread is not None:
            spread.note()
        assert frame.t is not None  # as of a usual frame
        assert not isinstance(pose, FrameError)
        ticket = body.plan(frame.seq, frame.t, pose, emotion=frame.emotion, group=group, keep=keep, spread=spread)
        self._note(ticket)
        return ticket

    def answer(self, tickets: Sequence[Ticket], outcomes: Sequence[Outcome | EngineError]) -> Sequence[Said]:
        """What the outcomes of tickets from `prompt` bring: as `conclude` with the replies of a whole message."""
        if tickets[0].group is None:
            return self._answer(tickets[0], outcomes[0])
        failed: list[Said] = []
        estimates: list[LeanEstimate] = []
        checkpoints: dict[str, Said] = {}  # by body, the newest only
        for ticket, outcome in zip(tickets, outcomes, strict=True):
            answer, *checkpoint = self._answer(ticket, outcome)
            if isinstance(answer, LeanEstimate):
                estimates.append(answer)
            else:
                failed.append(answer)
            for newer in checkpoint:
                checkpoints.pop(ticket.body, None)  # so that the newest comes last
                checkpoints[ticket.body] = newer
        told = [LeanEstimates(self._wanted(estimates))] if estimates else []
        return [*failed, *told, *checkpoints.values()]

    def _answer(self, ticket: Ticket, outcome: Outcome | EngineError) -> Sequence[Said]:
        """An estimate or an error, and a checkpoint if one is due."""
        body = self._roster.known(ticket.body)
        if isinstance(outcome, EngineError):
            return (self._failed(ticket, body, outcome),)
        self._counts["estimates"] += 1
        estimate = body.conclude(ticket, outcome)
        checkpoint = None if ticket.checkpoint is None else self._issuer.issue(ticket, body, outcome)
        return (estimate,) if checkpoint is None else (estimate, checkpoint)

    # --- outcomes -----------------------------------------------------------------------------------------------------

    def conclude(self, ticket: Ticket, outcome: Outcome | EngineError) -> list[Event]:
        """What a ticket's outcome brings: its estimate, or the error of a failed run.

        Outcomes may come in any order over the bodies; answers leave in the order in which the frames came.
        """
        events: list[Event] = []
        for concluded in self._under_way.conclude(ticket, outcome):
            events += self._conclude(*concluded)
        return events

    def _conclude(self, ticket: Ticket, outcome: Outcome | EngineError, body: Body, place: int) -> list[Event]:
        events: list[Event] = []
        if isinstance(outcome, EngineError):
            events = [Reply(self._failed(ticket, body, outcome))] if ticket.answer else []
        elif ticket.answer:
            events = self._deliver(ticket.group, place, body.conclude(ticket, outcome), body)
        if ticket.group is not None or ticket.checkpoint is not None or self._calibrated:
            events += self._follow(ticket, body, outcome)
        return events

    def _deliver(self, group: int | None, place: int, estimate: LeanEstimate, body: Body) -> list[Event]:
        """Send an estimate, or put it with its group; delivery `latest` skips one that a newer is about to replace."""
        self._counts["estimates"] += 1
        if group is not None:
            self._groups.put(group, place, estimate)
            return []
        return [] if self.agreement.latest and body.in_flight else [Reply(estimate)]

    def _failed(self, ticket: Ticket, body: Body, error: EngineError) -> Error:
        body.fail(ticket)
        return Error(code=error.code, message=error.message, fatal=False, body=ticket.body, seq=ticket.seq)

    def _follow(self, ticket: Ticket, body: Body, outcome: Outcome | EngineError) -> list[Event]:
        """What comes after a ticket's estimate: its checkpoint, and a calibration that ended with it."""
        checkpoint = self._issuer.issue(ticket, body, outcome)
        if ticket.group is None:
            said: list[Event] = [Reply(checkpoint)] if checkpoint else []
            group = self._calibrated.pop(ticket, None)
            return said if group is None else said + self._close_group(group)
        if checkpoint:
            self._groups.follow(ticket.group, checkpoint)
        return self._close_group(ticket.group)

    def _close_group(self, group: int) -> list[Event]:
        gathered = self._groups.close(group)
        if gathered is None:
            return []
        answers = self._wanted(gathered.estimates)
        events: list[Event] = [Reply(LeanEstimates(answers))] if answers else []
        return [*events, *map(Reply, gathered.followers)]

    def _wanted(self, answers: Sequence[LeanEstimate]) -> tuple[LeanEstimate, ...]:
        """Of the answers to a message: with delivery `latest`, the newest of each body."""
        return tuple({answer.body: answer for answer in answers}.values()) if self.agreement.latest else tuple(answers)

    # --- checkpoints --------------------------------------------------------------------------------------------------

    def resume(self, tokens: Sequence[str]) -> tuple[tuple[Resumed, ...], list[Restore]]:
        """Go on with the bodies of these tokens; see `fervor.session.resuming`."""
        return self._issuer.resume(tokens, self._roster)

    def checkpoints(self, group: int | None = None) -> list[Event]:
        """Ask for a checkpoint of every body, after all that is under way and, if any, the answers of `group`.

        None unless the client takes them, and none of a body that holds a pose for a calibration.
        """
        if self.agreement.terms.checkpoint_s is None:
            return []
        tickets: list[Event] = []
        for body in self._roster:
            if body.last is not None and not self._calibrator.holds(body.name):
                ticket = body.snapshot(body.last, group)
                if group is not None:
                    self._groups.expect(group)
                self._under_way.add(ticket, body)
                tickets.append(ticket)
        return tickets

    # --- bodies -------------------------------------------------------------------------------------------------------

    def reset(self, name: str) -> None:
        """Forget what a body did; raises FrameError where it is not known."""
        self._roster.known(name).reset()
        self._counts["resets"] += 1

    def end(self, name: str) -> list[Event]:
        """A body is gone; raises FrameError where it was never there."""
        released: Release = self._roster.end(name)
        return [released, *_replies((name, self._calibrator.gone(name)))]

    def release_all(self) -> list[Event]:
        """The session is over: forget what is under way, free what the bodies held."""
        self._under_way.clear()
        self._calibrated.clear()
        return [*self._roster.clear()]

    # --- calibration --------------------------------------------------------------------------------------------------

    def calibrate(self, request: SessionCalibrate) -> None:
        """Take the alignment from a pose that a body holds from now on; raises InputError where it can't be."""
        self._calibrator.begin(request, self.agreement.terms.source)

    def _calibrate(self, ticket: Ticket, pose: Pose) -> list[Event]:
        """Hand a frame to the calibration under way; adopt its result, told once this frame is answered."""
        try:
            found = self._calibrator.add(ticket, pose)
        except InputError as error:
            return _replies((ticket.body, error))
        if found is None:
            return []
        calibration, message = found
        self.agreement = self.agreement.aligned(calibration.skeleton)
        self._issuer = Issuer(self._host, self.agreement)
        for known in self._roster:
            known.adopt(self.agreement.terms)
        return self._tell_calibrated(ticket, message)

    def _tell_calibrated(self, ticket: Ticket, message: SessionCalibrated) -> list[Event]:
        """Once its last frame is answered, in one message with checkpoints under the new terms: the old ones are void.

        They cover all that is answered then: where a message has frames after that one, they come after the last.
        """
        group = self._groups.open() if ticket.group is None else ticket.group
        self._groups.follow(group, message)
        if ticket.group is not None:
            return []
        self._calibrated[ticket] = group
        return self.checkpoints(group)


def _last_of_bodies(frames: Sequence[AnyFrame]) -> set[int]:
    """The places of each body's last frame in a message: with that its checkpoint goes, if one is due."""
    return set({frame.body: place for place, frame in enumerate(frames)}.values())


def _is_known(emotion: str | Mapping[str, float]) -> bool:
    try:
        emotion_vector(emotion)
    except InputError:
        return False
    return True


def _plain(frame: AnyFrame) -> Frame:
    return frame.to_message() if isinstance(frame, LeanFrame) else frame


def _replies(gone: tuple[str, InputError | None]) -> list[Event]:
    """That the calibration of a body is over without a result, if there is an error that says so."""
    body, error = gone
    return [] if error is None else [Reply(refusal(error).model_copy(update={"body": body}))]
