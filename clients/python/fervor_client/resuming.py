"""What it takes to go on after a cut: per body the newest checkpoint, and every message sent since.

Rules: a message is kept until a checkpoint covers it · what is sent again leaves in the order in which it was first
sent · a body without a checkpoint goes on too, as long as all its messages are kept · beyond `MOST_KEPT` messages the
longest log is given up: its body can't be resumed until the next checkpoint, and after a cut begins anew with its
unanswered frames · a frame is kept until it is answered in any case · a service forgets bodies that fell idle when
another appears; the same is done here, and repeated in a replay as `body.end`, so that the replay does the same.
"""

import logging
from collections.abc import Callable, Collection, Iterable
from math import inf

from fervor.errors import InputError
from fervor.protocol.codec import Codec
from fervor.protocol.messages import BodyEnd, Checkpoint, Frame, Resumed, SessionCalibrate, SessionCalibrated
from fervor_client.answers import Key
from fervor_client.calibrations import Calibrations
from fervor_client.track import Entry, Payload, Track

logger = logging.getLogger("fervor_client")

MOST_KEPT = 4096
"""Messages kept over all bodies, beside unanswered frames: over a minute of two bodies at 30 Hz, about 8 MB."""

MOST_TOKENS = 64
TOKEN_SHARE = 0.9
"""Share of the largest message that the tokens of a `session.start` may take; the newest go first."""

STEP_BACK_S = 1.0
"""A frame that is older than its body's newest by no more than this is late; by more, the clock was set."""


class Log:
    """What the service may have to be told again."""

    def __init__(
        self,
        codec: Codec,
        *,
        latest: bool,
        emotion_ttl_s: float | None,
        now: Callable[[], float],
        idles: bool,
        keeps: bool = True,
    ) -> None:
        """`idles`: bodies without frames are forgotten, as under clock `time`; `keeps`: else it stays empty."""
        self.idle_s = inf
        """Client time without a frame after which the service may forget a body."""
        self.anew: set[str] = set()
        """Bodies that began anew and have no estimate yet."""
        self.calibrations = Calibrations(timed=idles)
        self._codec = codec
        self._latest = latest
        self._ttl_s = emotion_ttl_s
        self._now = now
        self._idles = idles
        self._keeps = keeps
        self._tracks: dict[str, Track] = {}
        self._open: dict[Key, Entry] = {}  # frames under way
        self._place = 0
        self._stale: tuple[str, ...] = ()  # bodies that the service resumed, and that are none any more

    # --- what is sent -------------------------------------------------------------------------------------------------

    def remind(self, frame: Frame) -> Frame:
        """The frame with the body's label, where it brings none and the service has lost the one in force."""
        track = self._tracks.get(frame.body)
        if track is None or not track.unlabelled or frame.emotion is not None or self._away(track, _time(frame)):
            return frame
        return frame.model_copy(update={"emotion": track.label_at(_time(frame), self._ttl_s)})

    def add_frame(self, frame: Frame, payload: Payload) -> None:
        """A frame was sent."""
        if self._keeps:
            self._keep(frame, payload)
        self.calibrations.sent((frame.body, frame.seq), _time(frame))  # of a body that may be gone and back with it

    def _keep(self, frame: Frame, payload: Payload) -> None:
        track = self._tracks.setdefault(frame.body, Track())
        begins = self._away(track, _time(frame))
        self._follow(track, frame, back=begins and track.here)
        entry = self._append(track, payload, seq=frame.seq)
        entry.begins = begins
        track.unlabelled = False
        if frame.emotion is not None:
            entry.label = (frame.emotion, _time(frame))
        self._open[frame.body, frame.seq] = entry
        if sum(len(track.entries) for track in self._tracks.values()) > MOST_KEPT + len(self._open):
            self._give_up_longest()

    def add_reset(self, body: str, payload: Payload) -> bool:
        """A body was reset; whether to tell the service, which has nothing to reset of a body that it lost."""
        track = self._tracks.get(body)
        if track is not None and track.here:
            self._append(track, payload)
        return not self._lost(body)

    def add_end(self, body: str, payload: Payload) -> bool:
        """A body has gone; whether to tell the service, which knows no more of a body that it lost."""
        track, lost = self._tracks.get(body), self._lost(body)
        if track is not None and track.here:
            self._end(body, track, payload)
        elif track is not None and lost:
            track.forget()
            self._bury(body, track)
        if lost:
            self.anew.discard(body)
        return not lost

    def add_calibrate(self, request: SessionCalibrate, payload: Payload) -> int:
        """A calibration was asked for; its number."""
        number = self.calibrations.ask(request, Entry(self._next_place(), payload))
        self._bury_all()
        return number

    # --- what comes ---------------------------------------------------------------------------------------------------

    def answered(self, keys: Iterable[Key], flags: Collection[str] = ()) -> None:
        """These frames have their estimates; a late one changed nothing, and a duplicate's may come before its turn."""
        late, repeated = "late" in flags, "duplicate" in flags
        for key in keys:
            if not repeated:
                self.calibrations.estimated(key)
            entry, track = self._open.pop(key, None), self._tracks.get(key[0])
            if entry is None or track is None:
                continue
            if late:
                entry.label = None
            track.answered(entry)
            self._bury(key[0], track)

    def refused(self, key: Key, *, forget: bool) -> None:
        """A frame was refused; `forget` it unless another try may give an estimate that later ones rest on."""
        entry, track = self._open.pop(key, None), self._tracks.get(key[0])
        if entry is None or track is None:
            return
        track.refused(entry, forget=forget)
        if forget and key[0] in self.anew:
            track.remind_again()
        self._bury(key[0], track)

    def checkpoint(self, message: Checkpoint) -> bool:
        """A checkpoint covers a body's messages up to its frame `seq`; whether it is of such a body."""
        track = self._tracks.get(message.body)
        if track is None:
            return False
        if message.seq != track.seq:
            covered = next((entry for entry in track.entries if self._covers(message, entry)), None)
            if covered is None:
                return False
            track.drop_through(covered)
        track.token, track.seq, track.since, track.whole = message.token, message.seq, self._now(), True
        self._bury(message.body, track)
        return True

    def begins_anew(self, body: str) -> bool:
        """Whether the first estimate comes of a body that the service had lost; asked once for each."""
        begins = body in self.anew
        self.anew.discard(body)
        return begins

    def calibrated(self, message: SessionCalibrated) -> None:
        """New terms are in force, and the bodies were reset: these checkpoints take the place of all before."""
        self.calibrations.calibrated(message)
        self._bury_all()
        renewed = {each.body for each in message.checkpoints if self.checkpoint(each)}
        for name, track in self._tracks.items():
            if name not in renewed and not track.untouched:
                track.give_up()

    def calibration_failed(self, body: str | None, error: InputError) -> bool:
        """Nothing came of one; whether there was one."""
        failed = self.calibrations.failed(body, error)
        self._bury_all()
        return failed

    # --- going on -----------------------------------------------------------------------------------------------------

    def tokens(self, most_bytes: int) -> tuple[str, ...]:
        """The checkpoints to resume from; those that find no room in a message are given up."""
        chosen: list[str] = []
        left = TOKEN_SHARE * most_bytes
        for track in sorted(self._tracks.values(), key=lambda track: -track.since):
            if not track.token:
                continue
            left -= len(track.token)
            if left < 0 or len(chosen) == MOST_TOKENS:
                track.give_up()
            else:
                chosen.append(track.token)
        return tuple(chosen)

    def refuse_tokens(self, *, older_than: float = inf) -> bool:
        """The service takes no checkpoints, or none that came before `older_than` (seconds); whether that's any."""
        refused = [track for track in self._tracks.values() if track.token and track.since < older_than]
        for track in refused:
            track.give_up()
        return bool(refused)

    def resumed(self, bodies: Iterable[Resumed]) -> None:
        """The service goes on with these only; what ended, or was given up, since it was asked must end there too."""
        known = {body.body: body.seq for body in bodies}
        for name, track in self._tracks.items():
            if track.token and track.seq != known.get(name):
                track.give_up()
        self._stale = tuple(name for name in known if name not in self._tracks or not self._tracks[name].token)

    def replay(self) -> tuple[list[Payload], list[Key]]:
        """What to send again, in order, and which of it are frames that were answered before."""
        for name in list(self._tracks):
            self._prepare(name, self._tracks[name])
        again = [(entry, name) for name, track in self._tracks.items() for entry in track.entries]
        again += [(entry, "") for entry in self.calibrations.entries]
        again.sort(key=lambda pair: pair[0].place)
        echoes = [(name, entry.seq) for entry, name in again if entry.seq is not None and entry.answered]
        ends = [self._codec.encode(BodyEnd(body=name)) for name in self._stale]
        return [*ends, *(entry.payload for entry, _ in again)], echoes

    def _prepare(self, name: str, track: Track) -> None:
        """Drop what a service without this body's checkpoint has no use for."""
        if track.whole and track.token:
            return
        if not track.whole:
            self.anew.add(name)
        track.begin_anew()
        if name in self.anew and track.entries and not track.entries[0].begins:
            self._remind(track, track.entries[0])

    def _remind(self, track: Track, entry: Entry) -> None:
        """Let the body's first frame bring the label that was in force before it."""
        frame = self._codec.decode_client(entry.payload)
        assert isinstance(frame, Frame), "a body begins with a frame"
        label = track.label_at(_time(frame), self._ttl_s)
        if frame.emotion is None and label is not None:
            entry.payload = self._codec.encode(frame.model_copy(update={"emotion": label}))
            entry.label = (label, _time(frame))

    # --- bookkeeping --------------------------------------------------------------------------------------------------

    def _covers(self, message: Checkpoint, entry: Entry) -> bool:
        return entry.seq == message.seq and (entry.answered or self._latest)

    def _next_place(self) -> int:
        self._place += 1
        return self._place

    def _append(self, track: Track, payload: Payload, *, seq: int | None = None) -> Entry:
        entry = Entry(self._next_place(), payload, seq)
        track.entries.append(entry)
        return entry

    def _lost(self, body: str) -> bool:
        """Whether the service lost a body, and nothing of it was sent since."""
        return body in self.anew and (body not in self._tracks or not self._tracks[body].here)

    def _away(self, track: Track, time: float) -> bool:
        """Whether a body's last frame is so long ago that the service has forgotten it."""
        return self._idles and track.last > -inf and time - track.last > self.idle_s

    def _follow(self, track: Track, frame: Frame, *, back: bool) -> None:
        """Note where a body stands, and which others the service forgets for it; `back`: it was forgotten itself.

        A frame that is refused later counts here too: only if it is the first of a body that was away, and the stream
        is then cut before the next, can a flag `gap_reset` differ.
        """
        time = _time(frame)
        if back:
            self.calibrations.gone(frame.body)
            track.newest, track.last = -1, -inf
        if self._idles and (back or not track.here):
            for name, other in list(self._tracks.items()):
                if other is not track and other.here and time - other.last > self.idle_s:
                    self._end(name, other, self._codec.encode(BodyEnd(body=name)))
        track.here = True
        if frame.seq > track.newest and not 0.0 <= track.last - time <= STEP_BACK_S:
            track.last = time
        track.newest = max(track.newest, frame.seq)

    def _end(self, name: str, track: Track, payload: Payload) -> None:
        self.calibrations.gone(name)
        track.end(self._append(track, payload))
        self._bury(name, track)

    def _bury_all(self) -> None:
        for name, track in list(self._tracks.items()):
            self._bury(name, track)

    def _bury(self, name: str, track: Track) -> None:
        if self.calibrations.holds(name):
            return  # what a calibration under way rests on is needed, even of a body that has gone
        if track.bury():
            self.anew.discard(name)
        if not track.entries and not track.here and not track.token and not track.unlabelled:
            self._tracks.pop(name, None)

    def _give_up_longest(self) -> None:
        whole = [item for item in self._tracks.items() if item[1].whole]
        if whole:
            name, track = max(whole, key=lambda item: len(item[1].entries))
            logger.warning("no checkpoint of body %r in %d messages; a cut would start it anew", name, MOST_KEPT)
            track.give_up()


def _time(frame: Frame) -> float:
    return float(frame.seq) if frame.t is None else frame.t
