"""Who gives out a session's checkpoints, and takes those of earlier ones back."""

from collections.abc import Sequence

from fervor.errors import EngineError
from fervor.protocol.messages import Checkpoint, Resumed
from fervor.session.body import Body
from fervor.session.checkpoint import Bond, pack
from fervor.session.events import Outcome, Restore, Ticket
from fervor.session.host import Host
from fervor.session.resuming import resume
from fervor.session.roster import Roster
from fervor.session.start import Agreement


class Issuer:
    """Checkpoints under one agreement."""

    def __init__(self, host: Host, agreement: Agreement) -> None:
        self._host = host
        self._agreement = agreement
        self._bond: Bond | None = None  # once one is needed

    def issue(self, ticket: Ticket, body: Body, outcome: Outcome | EngineError) -> Checkpoint | None:
        """The checkpoint that is due with a ticket, right after its outcome was concluded; None where none is."""
        if ticket.checkpoint is None or isinstance(outcome, EngineError) or outcome.memory is None:
            return None
        if self._host.seal is None or ticket.source != self._agreement.terms.source:
            return None  # after a calibration, a state before it belongs to terms that no longer hold
        content = pack(self._bound, body.bookkeeping(ticket), body.answers(), outcome.memory)
        return Checkpoint(body=body.name, seq=ticket.checkpoint.newest_seq, token=self._host.seal(content))

    def resume(self, tokens: Sequence[str], roster: Roster) -> tuple[tuple[Resumed, ...], list[Restore]]:
        """Go on with the bodies of these tokens; see `fervor.session.resuming`."""
        return resume(tokens, self._host, bond=self._bound, roster=roster, terms=self._agreement.terms)

    @property
    def _bound(self) -> Bond:
        if self._bond is None:
            self._bond = Bond(self._host.model.sha256, self._host.fingerprint, self._agreement.digest)
        return self._bond
