"""How many connections there are, and who is told."""

from asyncio import BaseTransport

from fervor.server.connections import MARGIN, Connections


def test_who_watches_is_told_of_all_that_come_and_go() -> None:
    connections, seen = Connections(1), []
    connections.watch(lambda: seen.append((connections.open, connections.entered)))
    one, two = BaseTransport(), BaseTransport()
    assert connections.enter(one)
    assert not connections.enter(two), "there is room for one"
    connections.leave(two)
    connections.leave(one)
    assert seen == [(1, 1), (2, 2), (1, 2), (0, 2)]
    assert connections.refused == 1


def test_beyond_a_margin_there_is_no_time_to_tell() -> None:
    connections = Connections(3)
    for _ in range(3 + MARGIN):
        connections.enter(BaseTransport())
    assert not connections.hopeless
    connections.enter(BaseTransport())
    assert connections.hopeless
