"""What a second worker is worth: the sum is right, and it can be taken of real workers."""

from pathlib import Path

import pytest

from fervor_bench.workers import Crew, measure_crews


def test_a_gain_is_of_cost_and_of_the_least_even_round() -> None:
    alone = Crew(1, 20.0, ((64,),))
    assert Crew(2, 20.0, ((32, 32),)).gain(alone) == pytest.approx(2.0)
    assert Crew(2, 25.0, ((32, 32),)).gain(alone) == pytest.approx(1.6)
    uneven = Crew(2, 20.0, ((32, 32), (16, 48), (30, 34)))
    assert uneven.gain(alone) == pytest.approx(2 * 32 / 48)
    assert uneven.lay == "16 + 48"


def test_one_worker_and_two_are_measured(workshop: Path) -> None:
    one, two = measure_crews(workshop, 0.4, sessions=8, rounds=2)
    assert (one.workers, two.workers) == (1, 2)
    assert one.rounds == ((8,), (8,))
    assert [sum(sessions) for sessions in two.rounds] == [8, 8]
    assert two.evenness > 0.6, "the sessions of two workers are not levelled"
    assert min(one.frame_us, two.frame_us) > 0
