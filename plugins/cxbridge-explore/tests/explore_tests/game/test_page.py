"""The page about a game: its lanes, its points, and what games without any of them look like."""

from __future__ import annotations

import re
import shutil

import pytest

from cxbridge.cli.main import invoke
from cxbridge.errors import CxbridgeError
from cxbridge_explore.game.page import write_page
from cxbridge_explore.game.score import Award, Delivery, GameResult, ProductOrder, RobotWork, Score
from cxbridge_explore.game.timeline import Span, Timeline, covered_seconds
from tests.support import ROOT, needs_plugin
from tests.trace.html.browser import BROWSER, show

pytestmark = [
    needs_plugin("web"),
    pytest.mark.skipif(BROWSER is None, reason="needs chromium or google-chrome on the path"),
]

EVIL = '<script>alert("x")</script>'

SCORE = Score(
    {"CYAN": 25, "MAGENTA": 0},
    (Delivery(1, "C0", "CYAN", 40.0), Delivery(2, "C1", "CYAN", 95.0)),
    (
        Award("CYAN", 10, 20.0, "PRODUCTION", "Mounted cap for order 1", "Mounted cap"),
        Award("CYAN", -5, 1100.0, "EXPLORATION", EVIL, EVIL),
        Award("CYAN", 20, 2000.0, "POST_GAME", "Delivered item", "Delivered item"),
    ),
    "POST_GAME",
    1200.0,
    (ProductOrder(1, "C0", 30, 60), ProductOrder(2, "C1", 50, 90), ProductOrder(3, "C3", 2000, 2100)),
)
TIMELINE = Timeline(
    1200.0,
    {
        "robot1": (
            Span(-5.0, 10.0, 'moveto{place="C-BS-I"}', "S_FINAL"),
            Span(10.0, 40.0, 'manipulate_wp{mps="C-BS", side="INPUT"}', "S_FAILED", "slipped"),
            Span(1190.0, 1300.0, EVIL, "S_RUNNING"),
        ),
        "robot2": (),
    },
    {
        "C-BS": (
            Span(0.0, 30.0, "IDLE"),
            Span(30.0, 60.0, "PROCESSING"),
            Span(60.0, 1200.0, "MELTED"),
        ),
        "M-BS": (Span(0.0, 1200.0, "IDLE"),),
    },
)
RESULT = GameResult(
    SCORE,
    True,
    7,
    1.0,
    {"robot1": RobotWork(155.0, 1150.0, {"slipped": 1}), "robot2": RobotWork(0.0, 1200.0)},
    timeline=TIMELINE,
)


def page_of(result, tmp_path):
    file = tmp_path / "game.html"
    write_page(result, file, f"cxbridge game {EVIL}")
    shown = show(file, tmp_path / "profile")
    assert shown.console == []
    return shown.dom


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    return page_of(RESULT, tmp_path_factory.mktemp("game"))


def bars(page, tone):
    """Return where bars of a tone begin, and how long they are."""
    found = re.findall(rf'<rect class="t-{tone}" x="([\d.]+)" y="[\d.]+" width="([\d.]+)"', page)
    return [(float(left), float(width)) for left, width in found]


def test_a_lane_for_each_robot_machine_and_order(page):
    labels = re.findall(r"<text[^>]*><title>([^<]*)</title>", page)
    assert labels == [
        *("Robots", "robot1", "robot2", "Machines", "C-BS", "Orders"),
        *("1: C0", "2: C1", "3: C3"),
    ]
    assert "Machines that did nothing: M-BS." in page


def test_bars_are_where_things_happened_and_end_with_the_production(page):
    second = (7200 - 8) / 1200
    assert bars(page, "failed") == [
        (pytest.approx(4 + 10 * second, abs=0.1), pytest.approx(30 * second, abs=0.1))
    ]
    assert bars(page, "done") == [(4, pytest.approx(10 * second, abs=0.1))]
    processing, running = (
        pytest.approx((4 + at * second, length * second), abs=0.1) for at, length in ((30, 30), (1190, 10))
    )
    assert sorted(bars(page, "active")) == [processing, running]
    assert ">1200 s</text>" in page


def test_what_failed_is_marked_and_says_why(page):
    assert "✗ manipulate_wp C-BS INPUT" in page
    assert "S_FAILED: slipped\n10.0 to 40.0 s (30.0 s)" in page
    assert "1 times: slipped" in page


def test_orders_tell_whether_they_came_in_time(page):
    points = re.findall(r'<circle class="point t-(\w+)"', page)
    assert points == ["done", "failed"]
    assert "95 (not in time)" in page


def test_points_over_time_end_at_the_score(page):
    assert ">CYAN 25</text>" in page
    assert "MAGENTA 0</text>" not in page
    assert page.count('<circle class="team0"') == 3


def test_nothing_in_the_page_runs(page):
    assert EVIL not in page
    assert "&lt;script&gt;alert" in page


def test_a_game_in_which_nothing_happened(tmp_path):
    nothing = GameResult(Score({}, (), (), "PRE_GAME", 0.0), False, 1, 1.0, {})
    page = page_of(nothing, tmp_path)
    for text in ("not over, in PRE_GAME", "no points", "no orders", "no machine", "no robot"):
        assert text in page


def test_a_page_that_cannot_be_written(tmp_path):
    with pytest.raises(CxbridgeError, match="cannot be written"):
        write_page(RESULT, tmp_path, "cxbridge game")


def test_times_of_which_several_are_at_once_count_once():
    assert covered_seconds([Span(0, 10, ""), Span(2, 5, ""), Span(8, 12, ""), Span(20, 21, "")]) == 13


@pytest.fixture
def short(tmp_path):
    """A copy of the workshop in which robots often find no way."""
    folder = tmp_path / "short"
    shutil.copytree(ROOT / "scenarios" / "workshop", folder)
    world = "skills: [{name: move, fails: [{error: blocked, after: 1, probability: 0.5}]}]\n"
    (folder / "world.yaml").write_text(f"{world}otherwise: {{fails: []}}\n")
    return folder


def test_the_command_writes_the_page_of_a_game(short, tmp_path, capsys):
    page = tmp_path / "game.html"
    words = ["game", str(short), "--minutes", "1", "--seed", "2"]
    assert invoke([*words, "--html", str(page)]) == 0
    with_page = capsys.readouterr().out
    text = show(page, tmp_path / "profile").dom
    assert ">✗</text>" in text
    assert "S_FAILED: blocked" in text
    labels = re.findall(r"<text[^>]*><title>([^<]*)</title>", text)
    assert labels[:4] == ["Robots", "robot1", "robot2", "Machines"]
    assert {"saw", "saw: skills"} <= set(labels)
    assert invoke(words) == 0
    without = capsys.readouterr().out
    assert with_page.rpartition(",")[0] == without.rpartition(",")[0]


@pytest.mark.parametrize(
    ("more", "complaint"),
    [
        (["--html", "/dev/null/folder/game.html"], "cannot be written: its folder cannot be made"),
        (["--html", "/tmp"], "cannot be written: it is a folder"),
        (["--html", "game.html", "--games", "2"], "--html shows only one game"),
        (["--html", "game.html", "--against", "two-robots"], "--html shows only one game"),
    ],
)
def test_pages_that_are_refused_before_the_game(short, capsys, more, complaint):
    assert invoke(["game", str(short), *more]) == 2
    out, err = capsys.readouterr()
    assert complaint in err
    assert out == ""
