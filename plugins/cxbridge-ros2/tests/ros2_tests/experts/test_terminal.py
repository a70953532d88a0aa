"""The commands of the prompt with valid and invalid words, their sources, and exit statuses."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.errors import CxbridgeError
from cxbridge_ros2.experts.client import ExpertRefusedError
from cxbridge_ros2.experts.terminal import HELP_LINES, Terminal
from cxbridge_ros2.experts.trees import TreeCodec
from ros2_tests.experts.agents import join_client, run_agent
from tests.forked import nursery

RESET = (
    "remove instance attic",
    "remove instance r2",
    "remove instance hall",
    "set instance r2 robot",
    "set instance hall room",
    "set predicate (at r2 hall)",
    "set function (= (battery r2) 3)",
    "set goal (and (clean hall) (not (at r2 dock)))",
)
OUTPUTS = {
    "get domain": ["(define (domain tour)"],
    "get model types": ["robot", "place", "room"],
    "get model predicates": ["at", "clean", "open"],
    "get model functions": ["distance", "battery"],
    "get model actions": ["sweep", "move (durative)"],
    "get model predicate at": ["(at ?robot0 - robot ?place1 - place)"],
    "get model function battery": ["(battery ?robot0 - robot)"],
    "get model action sweep": [
        "(sweep ?0 - robot ?1 - room)",
        "needs: (and (at ?0 ?1) (not (clean ?1)))",
        "does: (clean ?1)",
    ],
    "get model action Move": [
        "(Move ?0 - robot ?1 - place ?2 - place)",
        "at start needs: (and (at ?0 ?1))",
        "over all needs: (and (open))",
        "at start does: (and (not (at ?0 ?1)))",
        "at end does: (and (at ?0 ?2))",
    ],
    "get problem": ["(define (problem problem_1)"],
    "get problem instances": ["dock - place", "r2 - robot", "hall - room"],
    "get problem predicates": ["(open)", "(at r2 hall)"],
    "get problem functions": ["(= (battery r2) 3)"],
    "get problem goal": ["(and (clean hall) (not (at r2 dock)))"],
    "get plan": ["0.000: (sweep r2 hall) [0.001]"],
    "help": [*HELP_LINES],
    "quit": [],
    "": [],
}
EFFECTS = {
    "set instance attic  room": ("instances", ["dock - place", "r2 - robot", "hall - room", "attic - room"]),
    "set predicate (clean hall)": ("predicates", ["(open)", "(at r2 hall)", "(clean hall)"]),
    "set function (= (distance hall dock) 2.5)": (
        "functions",
        ["(= (battery r2) 3)", "(= (distance hall dock) 2.5)"],
    ),
    "set goal (or (clean hall) (>= (battery r2) 2))": ("goal", ["(or (clean hall) (>= (battery r2) 2))"]),
    "remove instance hall": ("instances", ["dock - place", "r2 - robot"]),
    "remove predicate (at r2 hall)": ("predicates", ["(open)"]),
    "remove function (battery r2)": ("functions", []),
    "remove goal": ("goal", ["no goal"]),
}
"""Commands without output, and the part of the problem that shows the effect."""
REFUSALS = {
    "get model predicate flies": "Predicate not found",
    "get model function speed": "Function not found",
    "get model action fly": "Action not found",
    "set instance x boat": "has no type",
    "set predicate (flies r2)": "Unknown predicate",
    "set function (= (speed r2) 1)": "Unknown function",
    "set goal (clean cellar)": "Unknown constant cellar",
    "remove instance r9": "is not an instance",
    "remove predicate (flies r2)": "Unknown predicate",
    "remove function (speed r2)": "Unknown function",
}
USAGE_ERRORS = {
    "frob": "unknown command 'frob'",
    "get": "unknown command 'get'",
    "get everything": "unknown command 'get everything'",
    "get model action": "there must be one name, not 0",
    "set instance r2": "a name and a type",
    "set predicate": "unexpected end of the condition",
    "set predicate r2": "unexpected 'r2'",
    "remove function (= (battery r2) 3)": "is not a function",
    "set predicate (not (at r2 hall))": "is not a predicate",
    "set function (battery r2)": "does not assign a number to a function",
    "set goal (and": "never closed",
    "remove instance": "there must be one name, not 0",
}


@pytest.fixture(scope="module")
def shared_terminal(domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Terminal]:
    with run_agent(tmp_path_factory.mktemp("daemon"), domain), join_client(domain) as client:
        yield Terminal(client, TreeCodec("iron"))


@pytest.fixture
def terminal(shared_terminal: Terminal) -> Terminal:
    for line in RESET:
        try:
            list(shared_terminal.run_line(line))
        except ExpertRefusedError:
            assert line.startswith("remove")
    shared_terminal.is_over = False
    return shared_terminal


@pytest.mark.parametrize("line", OUTPUTS)
def test_commands_print_results(terminal: Terminal, line: str):
    output = list(terminal.run_line(line))
    if line in ("get domain", "get problem"):
        assert output[0].splitlines()[:1] == OUTPUTS[line]
    else:
        assert output == OUTPUTS[line]


@pytest.mark.parametrize("line", EFFECTS)
def test_silent_commands_change_problem(terminal: Terminal, line: str):
    assert list(terminal.run_line(line)) == []
    part, expected = EFFECTS[line]
    assert list(terminal.run_line(f"get problem {part}")) == expected


@pytest.mark.parametrize("line", REFUSALS)
def test_refused_commands_raise_reason(terminal: Terminal, line: str):
    with pytest.raises(ExpertRefusedError, match=REFUSALS[line]):
        list(terminal.run_line(line))


@pytest.mark.parametrize("line", USAGE_ERRORS)
def test_malformed_commands_raise_usage_error(terminal: Terminal, line: str):
    with pytest.raises(CxbridgeError, match=USAGE_ERRORS[line]):
        list(terminal.run_line(line))


def test_missing_server_is_named(domain: int):
    with join_client(domain + 4) as client:
        client._server_timeout_s = 0.2
        with pytest.raises(CxbridgeError, match="/domain_expert/get_domain has no server"):
            list(Terminal(client, TreeCodec("iron")).run_line("get domain"))


def run_program(*words: str, lines: str = "") -> tuple[int, str, str]:
    terminal = nursery().begin(["ros2", "terminal", *words])
    with terminal.process, terminal.stdout, terminal.stderr:
        with terminal.stdin, suppress(BrokenPipeError):  # the program may refuse its options first
            terminal.stdin.write(lines.encode())
        output, errors = terminal.stdout.read().decode(), terminal.stderr.read().decode()
        return terminal.process.wait(120), output, errors


def test_program_exits_with_status_of_commands(terminal: Terminal, domain: int):
    node = ("--domain", str(domain), "--transport", "dds")
    assert run_program(*node, "get", "model", "types")[:2] == (0, "robot\nplace\nroom\n")
    status, output, errors = run_program(*node, "set", "instance", "x", "boat")
    assert (status, output) == (1, "")
    assert "Instance not valid: the domain has no type 'boat'" in errors
    assert run_program(*node, "frob")[0] == 2
    lines = "set predicate (clean hall)\nset predicate (clean dock)\nget problem predicates\nquit\nfrob\n"
    status, output, _ = run_program(*node, lines=lines)
    assert (status, output) == (1, "(open)\n(at r2 hall)\n(clean hall)\n")
    assert run_program("--transport", "pigeon", "get", "domain")[0] == 2


def test_program_reads_commands_from_terminal(terminal: Terminal, domain: int):
    master, slave = pty.openpty()
    command = [sys.executable, "-m", "cxbridge", "ros2", "terminal", "--domain", str(domain)]
    with subprocess.Popen(
        command, stdin=slave, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        os.write(master, b"get model types\nquit\n")
        output, _ = process.communicate(timeout=120)
    assert process.returncode == 0
    assert "robot\nplace\nroom\n" in output
    os.close(master)
    os.close(slave)
