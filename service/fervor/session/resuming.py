"""Bodies that go on from checkpoints."""

from collections.abc import Sequence
from functools import partial

from fervor.errors import CheckpointUnknown, ProtocolError
from fervor.protocol.messages import Resumed
from fervor.session.body import Body, Terms
from fervor.session.checkpoint import Bond, unpack
from fervor.session.events import Restore
from fervor.session.host import Host
from fervor.session.roster import Roster


def resume(
    tokens: Sequence[str], host: Host, *, bond: Bond, roster: Roster, terms: Terms
) -> tuple[tuple[Resumed, ...], list[Restore]]:
    """Put the bodies of these tokens into a roster, all or none: what to tell the client, and what to restore.

    Raises:
        CheckpointUnknown: a token that this service can't take.
        CheckpointMismatch: a checkpoint of another model or other terms.
        ProtocolError: a body twice, or more than the service takes.
    """
    if host.unseal is None:
        raise CheckpointUnknown("this service gives and takes no checkpoints; start without resume")
    opened = [unpack(host.unseal(token), bond) for token in tokens]
    if len({kept.body.name for kept in opened}) != len(opened):
        raise ProtocolError("resume names a body twice; expected its newest checkpoint only")
    if len(opened) > host.limits.max_bodies:
        raise ProtocolError(f"resume has {len(opened)} bodies; this service takes {host.limits.max_bodies}")
    resumed: list[Resumed] = []
    restores: list[Restore] = []
    for kept in opened:
        body = roster.restore(partial(Body.restore, kept.body, kept.answers, terms=terms))
        restores.append(Restore(body.slot, kept.memory))
        resumed.append(Resumed(body=body.name, seq=body.newest_seq, same_runtime=kept.same_runtime))
    return tuple(resumed), restores
