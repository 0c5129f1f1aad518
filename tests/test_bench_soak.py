"""A soak finds what grows, and finds nothing at a service that does not."""

import asyncio
from dataclasses import replace

import pytest
from bench.soak import Sample, growth, leftovers, soak, swellings
from rich.console import Console


def samples(*, start: float = 150.0, slope: float = 0.0, seconds: int = 600) -> list[Sample]:
    """Memory that jumps at first, then wobbles about a line of `slope` MiB a minute."""
    return [
        Sample(at, start + 40.0 * min(at / 60.0, 1.0) + slope * at / 60.0 + (at % 7) * 0.3, 30, 8, 9)
        for at in range(1, seconds, 10)
    ]


REST = Sample(0.0, 150.0, 20, 0, 1)


def test_growth_is_measured_after_the_warm_up():
    assert growth(samples(slope=0.0)) == pytest.approx(0.0, abs=0.1)
    assert growth(samples(slope=6.0)) == pytest.approx(6.0, abs=0.1)


def test_what_does_not_grow_is_no_complaint():
    assert swellings(samples(slope=0.5)) == []
    assert leftovers(REST, replace(REST, memory=300.0, descriptors=19)) == []


def test_each_leak_is_told():
    told = swellings(samples(slope=9.0)) + leftovers(REST, Sample(600.0, 190.0, 23, 1, 4))
    assert [sentence.split()[0] for sentence in told] == ["memory", "23", "1", "4"]


def test_noise_of_a_short_run_is_no_complaint():
    assert swellings(samples(slope=9.0, seconds=30)) == []


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_service_under_churn_does_not_grow():
    assert asyncio.run(soak(40.0, 8, Console())) == []
