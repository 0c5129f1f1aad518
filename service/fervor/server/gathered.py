"""The metrics of all workers of a service, from whichever of them is asked: each one's own, with a label `worker`.

Labelled and not summed: a worker that is killed takes its counts with it, and a sum that falls would be taken for a
restart of the whole. Why not prometheus_client's own way for many processes: it keeps files, for which a read-only
container has no place, and knows no collectors that read when they are asked.
"""

import pickle
from collections.abc import Iterable

from prometheus_client.core import Metric
from prometheus_client.registry import Collector

from fervor.server.board import Board

LABEL = "worker"


class Gathered(Collector):
    """One worker's metrics, which it shows the others, beside those that they show."""

    def __init__(self, own: Collector, board: Board, place: int) -> None:
        self._own = own
        self._board = board
        self._place = place

    def show(self) -> None:
        """Let the others know how things stand here."""
        self._board.show(self._place, pickle.dumps(list(self._own.collect())))

    def collect(self) -> Iterable[Metric]:
        """The families of all workers, each once."""
        families: dict[tuple[str, str], Metric] = {}
        for place, shown in sorted(self._shown().items()):
            for metric in shown:
                empty = Metric(metric.name, metric.documentation, metric.type)
                whole = families.setdefault((metric.name, metric.type), empty)
                for sample in metric.samples:
                    whole.samples.append(sample._replace(labels={**sample.labels, LABEL: str(place)}))
        return families.values()

    def _shown(self) -> dict[int, Iterable[Metric]]:
        """What each worker shows, by its place; our own as it is now."""
        shown: dict[int, Iterable[Metric]] = {self._place: self._own.collect()}
        for place in range(self._board.places):
            if place != self._place and (content := self._board.read(place)) is not None:
                shown[place] = pickle.loads(content)  # noqa: S301  # memory of our own processes alone
        return shown
