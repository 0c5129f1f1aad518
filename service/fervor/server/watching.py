"""What a watcher sees: pictures taken of the sessions, when they are wanted and as often as they are taken.

Rules. Nothing is noted for watchers as frames pass: a picture reads what sessions and engine hold anyway, so a stream
costs the same whether it is watched or not. A picture has a bounded number of bodies. The next one is taken only when
the last was sent: who reads slowly sees fewer, and always the newest.
"""

from collections.abc import Iterator, Mapping
from itertools import islice

import numpy as np

from fervor import __version__
from fervor.emotions import EMOTIONS
from fervor.engine.slots import Slots
from fervor.protocol.trusted import trusted
from fervor.server.service import Service
from fervor.server.watch_messages import (
    MOST_SESSIONS,
    MOST_SHOWN,
    BodyName,
    Look,
    SeenBody,
    SeenSession,
    Snapshot,
    WatchStarted,
)
from fervor.session.body import Body
from fervor.session.session import Session
from fervor.skeletons.rig import CHILD_SEGMENT, JOINTS, PARENTS, SEGMENTS
from fervor.skeletons.standard_body import HIPS_ABOVE_GROUND_M, OFFSETS_M, TIPS_M

RATE_HZ = 12.0
"""Pictures a second: motion looks whole, and a page costs little."""

DIGITS = 4
"""Of rotations: a ten-thousandth is a hundredth of a degree."""

_MOVED = tuple(SEGMENTS[segment] for segment in CHILD_SEGMENT)
"""The segment that each joint moves."""

_OF_ESTIMATE = ("body", "seq", "t", "intensity", "level", "emotion", "status", "flags")


def started(service: Service) -> WatchStarted:
    """What a watcher is told first."""
    return WatchStarted(
        version=__version__,
        model=service.host.model,
        hysteresis=service.model.metadata.levels.hysteresis,
        joints=JOINTS,
        parents=PARENTS,
        pelvis=(0.0, HIPS_ABOVE_GROUND_M, 0.0),
        offsets=tuple(OFFSETS_M[segment] for segment in _MOVED),
        tips=tuple(map(TIPS_M.get, _MOVED)),
        workers=service.settings.workers,
        rate_hz=RATE_HZ,
    )


def take_snapshot(service: Service, look: Look) -> Snapshot:
    """What there is to see now. `look` past the end shows the last bodies."""
    sessions = [conversation.session for conversation in service.drain.talking]
    answered = [(session, body) for session in sessions for body in session.bodies if body.begun]
    first = min(look.first, max(len(answered) - 1, 0) // MOST_SHOWN * MOST_SHOWN)
    shown = answered[first : first + MOST_SHOWN]
    thresholds = service.host.model.thresholds
    slots = service.batcher.engine.slots
    return Snapshot(
        sessions=tuple(map(_session, islice(sessions, MOST_SESSIONS))),
        sessions_total=len(sessions),
        bodies=tuple(_bodies(shown, slots, thresholds, frozenset(look.by_emotion))),
        bodies_total=len(answered),
        first=first,
    )


def _session(session: Session) -> SeenSession:
    return SeenSession(
        session=session.session_id,
        skeleton=session.source and session.source.skeleton.name,
        bodies=sum(1 for _ in session.bodies),
        frames=session.totals.frames,
    )


def _bodies(
    shown: list[tuple[Session, Body]], slots: Slots, thresholds: Mapping[str, float], asked: frozenset[BodyName]
) -> Iterator[SeenBody]:
    rows = np.array([body.slot for _, body in shown], np.intp)
    poses = np.round(slots.pose[rows], DIGITS).tolist()  # [body][joint][4]
    observed = slots.observed[rows].tolist()  # [body][joint]
    for (session, body), pose, seen in zip(shown, poses, observed, strict=True):
        estimate = body.newest
        assert estimate is not None
        wanted = BodyName(session=session.session_id, body=body.name) in asked and estimate.intensity is not None
        fields = {
            "session": session.session_id,
            **{name: getattr(estimate, name) for name in _OF_ESTIMATE},
            "threshold": thresholds[estimate.emotion],
            "q": pose,
            "observed": seen,
            "by_emotion": dict(zip(EMOTIONS, slots.by_emotion[body.slot].tolist(), strict=True)) if wanted else None,
        }
        yield trusted(SeenBody, fields)
