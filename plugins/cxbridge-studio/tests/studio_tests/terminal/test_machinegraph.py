"""Graphs of state machines, read back."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import SkillerError
from cxbridge.skiller.lua.engine import LuaEngine
from cxbridge_studio.terminal.machinegraph import MachineState, MachineTransition, StateMachine, parse_graph
from tests.skiller.rig import Rig, write_skills
from tests.skiller.test_graphs import MACHINES, SPACE


@pytest.fixture
def engine(tmp_path: Path) -> LuaEngine:
    space = SPACE + "".join(f"skillenv.use_skill('skills.{name}')\n" for name in MACHINES)
    write_skills(tmp_path, {**MACHINES, "space": space})
    return Rig().lua([tmp_path], space="space").engine


def run(engine: LuaEngine, skill: str, times: int) -> StateMachine:
    assert engine.compile(f"{skill}{{}}") == ""
    for _ in range(times):
        engine.run()
    return parse_graph(engine.draw_graph(skill, "TB", coloured=True, redraw=True)[1])


def test_the_states_and_where_it_is(engine: LuaEngine):
    machine = run(engine, "leaf", 2)
    states = {state.name: state for state in machine.states}
    assert machine.name == 'a "leaf"'
    assert states["FIRST"] == MachineState("FIRST", "FIRST", is_active=True, kind="start")
    assert (states["SECOND"].note, states["three"].note) == ("the middle", "x")
    assert states["odd name"].node == "odd name"
    assert {name: state.kind for name, state in states.items() if state.kind} == {
        "FIRST": "start",
        "FINAL": "final",
        "FAILED": "failed",
    }
    assert [state.name for state in machine.states if state.is_active] == ["FIRST"]


def test_the_transitions_and_the_way(engine: LuaEngine):
    machine = run(engine, "leaf", 3)
    assert MachineTransition("FIRST", "SECOND", "on in two lines", (1, 3)) in machine.transitions
    assert MachineTransition("SECOND", "FIRST", 'back to "FIRST"', (2,)) in machine.transitions
    assert [item.target for item in machine.taken_transitions()] == ["SECOND", "FIRST", "SECOND"]


def test_machines_within_states(engine: LuaEngine):
    machine = run(engine, "nest", 1)
    assert [(depth, part.name) for depth, part in machine.walk()] == [(0, "nest"), (1, "mid"), (2, "deep")]
    deep = machine.inner[0].inner[0]
    assert {state.name for state in deep.states} == {"D1", "D2", "FINAL", "FAILED"}
    active = [state.name for _, part in machine.walk() for state in part.states if state.is_active]
    assert active == ["IN", "M2", "D2"]


def test_who_uses_whom(engine: LuaEngine):
    machine = parse_graph(engine.overview("SKILL_DEP"))
    assert [state.name for state in machine.states] == ["leaf", "nest", "folded"]
    assert machine.transitions == [MachineTransition("nest", "leaf")]


def test_a_graph_that_is_cut_off_is_told(engine: LuaEngine):
    graph = engine.draw_graph("nest", "TB", coloured=True, redraw=True)[1]
    for length in range(0, len(graph) - 2, 7):
        with pytest.raises(SkillerError):
            parse_graph(graph[:length])


@pytest.mark.parametrize("text", ["say\nwait\n", "graph x {}", "digraph x y"])
def test_what_is_no_graph_is_refused(text: str):
    with pytest.raises(SkillerError, match="not a graph of a state machine"):
        parse_graph(text)


@given(st.text(st.sampled_from('ab{}[]",;=->\\ \n'), max_size=60))
def test_any_text_is_read_or_refused(text: str):
    with contextlib.suppress(SkillerError):
        parse_graph(f"digraph g {{{text}")
