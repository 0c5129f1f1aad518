"""Metrics of all workers from any of them."""

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from prometheus_client.parser import text_string_to_metric_families

from fervor.server.board import Board
from fervor.server.gathered import Gathered


def worker(board: Board, place: int, refused: int) -> Gathered:
    registry = CollectorRegistry()
    Gauge("open", "open now", registry=registry).set(place)
    Counter("refused", "not let in", labelnames=("reason",), registry=registry).labels("full").inc(refused)
    Histogram("wait", "seconds", buckets=(1.0,), registry=registry).observe(0.5)
    return Gathered(registry, board, place)


def samples(gathered: Gathered) -> dict[tuple[str, ...], float]:
    return {
        (sample.name, *sorted(sample.labels.values())): sample.value
        for family in text_string_to_metric_families(generate_latest(gathered).decode())
        for sample in family.samples
        if not sample.name.endswith("_created")
    }


def test_each_shows_all_that_others_showed_and_its_own_as_it_is_now() -> None:
    board = Board(3)
    one, two = worker(board, 0, refused=5), worker(board, 2, refused=7)
    assert samples(one)["refused_total", "0", "full"] == 5
    assert ("refused_total", "2", "full") not in samples(one)
    two.show()
    one.show()
    assert samples(one) == samples(two)
    assert samples(one)["refused_total", "2", "full"] == 7
    assert samples(one)["wait_bucket", "+Inf", "2"] == 1


def test_each_family_is_told_once() -> None:
    board = Board(2)
    one, two = worker(board, 0, refused=1), worker(board, 1, refused=1)
    two.show()
    text = generate_latest(one).decode()
    assert text.count("# TYPE open gauge") == text.count("# TYPE refused_total counter") == 1


def test_a_worker_that_is_gone_is_told_no_more() -> None:
    board = Board(2)
    one, two = worker(board, 0, refused=1), worker(board, 1, refused=1)
    two.show()
    board.clear(1)
    assert {labels[1] for labels in samples(one) if labels[0] == "open"} == {"0"}
