import io
import math

import pytest
from rich.console import Console

from fervor.cli.meter import Meter, bar, describe, plain_line, remarks, sparkline
from fervor.levels import Level
from fervor.protocol.messages import Estimate, ModelInfo

MODEL = ModelInfo(
    name="m",
    version="1.2",
    purpose="research",
    sha256="0",
    rate_hz=30.0,
    emotions=("joy",),
    thresholds={"joy": 0.25, "unknown": 0.5},
)
DEMO = MODEL.model_copy(update={"purpose": "demo"})


def estimate(t: float, intensity: float | None = 0.5, **fields) -> Estimate:
    fields = {"level": "strong", "emotion": "joy", "status": "ok", **fields}
    return Estimate(body="0", seq=round(t * 1000), t=t, intensity=intensity, **fields)


def drawn(meter: Meter, width: int = 80, encoding: str = "utf-8") -> str:
    """What a terminal without colours would show."""
    stream = io.TextIOWrapper(io.BytesIO(), encoding=encoding, newline="\n")
    Console(file=stream, width=width, force_terminal=False).print(meter)
    stream.seek(0)
    return stream.read()


def test_a_meter_shows_what_one_wants_to_know() -> None:
    shown = drawn(Meter("wave.bvh", MODEL, [estimate(3.2, 0.74)], duration_s=12.0))
    top, first, *_, last = shown.strip().splitlines()
    assert "wave.bvh" in top
    assert "3.2 of 12.0 s" in top
    assert all(word in first for word in ("joy", "0.74", "STRONG", "━", "┿", "─"))
    assert "model m 1.2" in last
    assert "demo" not in shown


def test_a_demo_model_says_so_wherever_it_shows() -> None:
    assert "demo model m 1.2" in drawn(Meter("wave.bvh", DEMO, [estimate(0.0)]))
    assert "demo model m 1.2" in drawn(Meter("wave.bvh", DEMO))
    assert describe(MODEL) == "model m 1.2"


def test_a_meter_waits_for_its_first_estimate() -> None:
    assert "waiting" in drawn(Meter("wave.bvh", MODEL))


def test_a_meter_without_a_pose_shows_no_number() -> None:
    shown = drawn(Meter("wave.bvh", MODEL, [estimate(0.0, None, level=None, status="insufficient", flags=("lost",))]))
    assert "no pose" in shown
    assert "insufficient, lost" in shown
    assert "0.00" not in shown


@pytest.mark.parametrize("width", [40, 80, 100, 200])
def test_a_meter_keeps_its_shape_and_leaves_room_for_ctrl_c(width: int) -> None:
    many = [estimate(n / 120, 0.5 + 0.5 * math.sin(n / 30)) for n in range(1500)]
    lines = drawn(Meter("wave.bvh", DEMO, many, 12.5), width).strip("\n").splitlines()
    assert len(lines) == 6
    assert {len(line) for line in lines} == {min(width - 3, 100)}


def test_a_terminal_without_unicode_gets_ascii() -> None:
    shown = drawn(Meter("wave.bvh", DEMO, [estimate(n / 30, n / 300) for n in range(300)]), encoding="ascii")
    assert shown.isascii()
    assert all(sign in shown for sign in "#.|")


def test_a_meter_has_colours_where_they_are_wanted() -> None:
    console = Console(file=io.StringIO(), width=80, force_terminal=True, color_system="standard", record=True)
    console.print(Meter("wave.bvh", DEMO, [estimate(0.0)]))
    html = console.export_html()
    assert "STRONG" in html
    assert "800080" in html  # magenta


@pytest.mark.parametrize(
    ("intensity", "shown"),
    [(0.0, "|..."), (0.25, "|..."), (0.5, "|#.."), (1.0, "|###"), (None, "|...")],
)
def test_a_bar_is_filled_up_to_the_intensity_and_marked_at_the_threshold(intensity: float, shown: str) -> None:
    assert bar(intensity, 0.0, 4, "", ascii_only=True).plain == shown


@pytest.mark.parametrize(("mark", "place"), [(0.0, 0), (0.5, 5), (0.99, 9), (1.0, 9)])
def test_a_mark_stays_on_the_bar(mark: float, place: int) -> None:
    assert bar(0.0, mark, 10, "").plain.index("┿") == place


def test_a_sparkline_rises_with_the_intensity_and_ends_now() -> None:
    (line,) = sparkline([estimate(t + 0.5, t / 8) for t in range(9)], 9, span_s=9.0)
    assert line == "▁▁▂▃▄▅▆▇█"
    (later,) = sparkline([estimate(t + 0.5, t / 8) for t in range(9)], 12, span_s=12.0)
    assert later == "   ▁▁▂▃▄▅▆▇█"


def test_a_sparkline_of_two_rows_has_twice_the_steps() -> None:
    upper, lower = sparkline([estimate(t + 0.5, t / 4) for t in range(5)], 5, rows=2, span_s=5.0)
    assert lower == "▁▄███"
    assert upper == "   ▄█"


def test_a_sparkline_forgets_what_is_long_ago_and_leaves_gaps_blank() -> None:
    many = [estimate(0.5, 1.0), estimate(6.5, 1.0), estimate(9.5, 1.0), estimate(10.5, None)]
    assert sparkline(many, 5, span_s=5.0) == ["█  █ "]
    assert sparkline([], 3) == ["   "]


def test_a_slice_of_time_does_not_change_while_time_goes_on() -> None:
    many = [estimate(n / 30, abs(math.sin(n / 7))) for n in range(600)]
    (before,) = sparkline(many[:500], 40)
    (after,) = sparkline(many[:507], 40)  # 0.23 s: one slice
    assert before[2:-1] in after


def test_remarks_keep_a_flag_in_sight_for_a_second_and_the_usual_ones_out_of_it() -> None:
    many = [estimate(0.0, flags=("gap_reset",)), estimate(0.5, flags=("between_steps", "jump")), estimate(0.9)]
    assert remarks(many) == "ok, gap reset, jump"
    assert remarks([*many, estimate(1.2)]) == "ok, jump"
    assert remarks([estimate(0.0, status="warming_up", flags=("interpolated",))]) == "warming up"


def test_a_plain_line_is_plain() -> None:
    line = plain_line(estimate(1.5, 0.62, level=Level.STRONG), 0.5, width=10)
    assert line == "   1.50 s  joy        0.62  [#####|....]  strong  ok"
    lost = plain_line(estimate(61.25, None, level=None, emotion="unknown", status="insufficient"), 0.5, width=4)
    assert lost == "  61.25 s  unknown     --   [..|.]          insufficient"
