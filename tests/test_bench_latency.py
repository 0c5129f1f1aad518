"""Percentiles by rank."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fervor_bench.latency import Latency

TIMES = st.lists(st.floats(0, 1e6, width=32), min_size=1, max_size=2000)


@given(TIMES)
def test_percentiles_are_numpys_by_rank(times: list[float]) -> None:
    values = np.array(times, np.float32)
    latency = Latency.of(values)
    expected = np.percentile(values.astype(np.float64), [50, 99, 99.9, 100], method="inverted_cdf") / 1000
    np.testing.assert_allclose([latency.p50_ms, latency.p99_ms, latency.p999_ms, latency.largest_ms], expected)


def test_frames_without_an_answer_wait_for_ever() -> None:
    latency = Latency.of(np.full(980, 2000, np.float32), unanswered=20)
    assert (latency.p50_ms, latency.p99_ms) == (2.0, math.inf)
    latency = Latency.of(np.full(995, 2000, np.float32), unanswered=5)
    assert (latency.p99_ms, latency.p999_ms) == (2.0, math.inf)


def test_nothing_at_all_is_infinite() -> None:
    assert Latency.of(np.zeros(0, np.float32)).p50_ms == math.inf
