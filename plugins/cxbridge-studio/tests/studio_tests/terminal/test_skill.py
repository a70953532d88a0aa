"""The commands `cxbridge skill monitor` and `skill graph`."""

from __future__ import annotations

import json
import re

import pytest

from cxbridge.blackboard import Listener
from cxbridge.cli.main import invoke
from cxbridge.clock import RealClock
from cxbridge.interfaces import SkillerInterface
from cxbridge.skiller.simulation.simulator import SkillerSimulator
from cxbridge_studio.cli import skill
from tests.cli.boards import WAIT_S, Looping, SharedBoard, silent_bus
from tests.cli.test_skill import Estimator


@pytest.fixture
def board(monkeypatch):
    made = SharedBoard()
    monkeypatch.setattr(skill, "connect", lambda _url, _dirs: made)
    yield made
    assert made.left_open() == []
    made.shutdown()


@pytest.fixture
def skiller(board):
    bus = silent_bus()
    with Looping(lambda: SkillerSimulator(board, RealClock(), bus, [Estimator(seconds=0.0)])):
        yield board.open_for_reading(SkillerInterface, "Skiller", owner="test")


def run(*arguments):
    return invoke(["skill", *arguments])


def test_monitor(skiller, capsys):
    skiller.msgq_enqueue(SkillerInterface.ExecSkillMessage(skill_string="fail{}"))
    assert run("monitor", "--count", "1", "--timeout", str(WAIT_S)) == 0
    assert len(capsys.readouterr().out.splitlines()) == 1
    assert run("monitor", "--timeout", "0.2", "--json") == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["skill_string"] == "fail{}"


GRAPH = """digraph go {
	drive [penwidth="4.0", color="#ffc080"];
	turn [active="true", comment="slowly", label="turn\\n(slowly)"];
	FINAL [shape="doubleoctagon", color="#6fdd6f"];
	subgraph cluster_1 {
		graph  [label="inner"];
		g1_A [active="true", label="A"];
	}
	drive -> turn [taillabel="1", label="arrived"];
	turn -> FINAL [label="turned"];
}
"""


def test_monitor_on_a_terminal_draws_the_machine(board):
    """States, the current one, the way there, what the skill uses, machines within."""
    from io import StringIO

    from rich.console import Console

    from cxbridge.blackboard.following import Deadline
    from cxbridge_studio.terminal.live import show_skiller

    class Show(Listener):
        def message_received(self, interface, message):
            interface.graph_fsm = message.graph_fsm
            interface.graph = "digraph d { go -> motor; }" if message.graph_fsm == "SKILL_DEP" else GRAPH
            interface.write()
            return False

    debug = board.open_for_writing("SkillerDebugInterface", "Skiller", owner="skiller")
    board.register_listener(Show(), debug)
    writer = board.open_for_writing(SkillerInterface, "Skiller", owner="skiller")
    writer.skill_string, writer.status, writer.msgid = "go{}", SkillerInterface.S_RUNNING, 7
    writer.error = "late"
    writer.write()
    screen = StringIO()
    console = Console(file=screen, force_terminal=True, width=60)
    assert show_skiller(board, "Skiller", 1, Deadline(WAIT_S), console)
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue()).rpartition("\r")[2]
    here, been, to = "\N{BLACK CIRCLE}", "\N{WHITE CIRCLE}", "\N{RIGHTWARDS ARROW}"
    assert [line.rstrip() for line in text.splitlines()] == [
        "S_RUNNING go{}  #7, control: nobody",
        "late",
        "",
        "go  uses motor",
        f"{been} drive          {to} turn [1]  arrived",
        f"{here} turn (slowly)  {to} FINAL  turned",
        "  FINAL",
        "  inner",
        f"  {here} A",
        f"path: drive {to} turn",
    ]
    assert not show_skiller(board, "Skiller", 2, Deadline(0.1), console)


def test_graph_from_files_and_from_a_skiller(board, capsys, tmp_path):
    """Both give the same; a name tells the format."""
    from cxbridge.skiller.make import make_lua_skiller

    picture = tmp_path / "say.dot"
    assert run("graph", "say", "--direction", "LR", "-o", str(picture)) == 0
    with Looping(lambda: make_lua_skiller(board, RealClock(), silent_bus())):
        assert run("graph", "say", "--direction", "LR", "--color", "--connect", "tcp://x") == 0
    assert capsys.readouterr().out == picture.read_text()
    assert picture.read_text().startswith("digraph say {")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["graph", "sing"], "there is no skill 'sing' in the skill space 'test'"),
        (["graph", "say", "-o", "say.gif"], "use .svg, .png, .pdf or .dot"),
        (["graph", "say", "--direction", "up"], "use one of: TB, BT, LR, RL"),
        (["graph", "say", "--connect", "tcp://x"], "no Skiller writes SkillerDebugInterface::Skiller"),
    ],
)
def test_what_cannot_be_drawn_is_one_error(board, capsys, arguments, message):
    assert run(*arguments) == 2
    assert message in capsys.readouterr().err
