"""Tickets whose outcome is still to come, so that answers leave in the order in which the frames came."""

from typing import NamedTuple

from fervor.errors import EngineError
from fervor.session.body import Body
from fervor.session.events import Outcome, Ticket


class Concluded(NamedTuple):
    """A ticket with its outcome, in its turn."""

    ticket: Ticket
    outcome: Outcome | EngineError
    body: Body
    place: int
    """Of its frame in the message, where that has several."""


class UnderWay:
    """The tickets of one session."""

    def __init__(self) -> None:
        self.tickets: dict[Ticket, tuple[Body, int]] = {}
        """With body and place in the message, as they were planned."""
        self._outcomes: dict[Ticket, Outcome | EngineError] = {}  # that wait for those of earlier tickets

    def add(self, ticket: Ticket, body: Body, place: int = -1) -> None:
        """A ticket was planned, after all before."""
        self.tickets[ticket] = body, place

    def conclude(self, ticket: Ticket, outcome: Outcome | EngineError) -> list[Concluded]:
        """An outcome came: the tickets whose turn it is now, none if the session is over."""
        tickets, outcomes = self.tickets, self._outcomes
        if ticket not in tickets:
            return []
        outcomes[ticket] = outcome
        concluded = []
        while tickets and (oldest := next(iter(tickets))) in outcomes:
            concluded.append(Concluded(oldest, outcomes.pop(oldest), *tickets.pop(oldest)))
        return concluded

    def clear(self) -> None:
        """The session is over."""
        self.tickets.clear()
        self._outcomes.clear()
