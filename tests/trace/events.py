"""Hypothesis strategies for events."""

from __future__ import annotations

from hypothesis import strategies as st

from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    Level,
    LogLine,
    LoopTime,
    NavGraphRead,
    PlanActionTransition,
    PlannerCall,
    RuleFired,
    SkillStatus,
)

times = st.integers(0, 2**60 // 1000)
texts = st.text(st.characters(blacklist_categories=["Cs"]), max_size=20)
names = st.from_regex(r"[A-Za-z][A-Za-z0-9_-]{0,10}", fullmatch=True)
numbers = st.integers(0, 2**40)
plain = st.one_of(st.booleans(), st.integers(-(2**63), 2**64), st.floats(allow_nan=False), texts)
values = st.dictionaries(names, st.one_of(plain, st.lists(plain, max_size=4)), max_size=4)

log_lines = st.builds(LogLine, times, st.sampled_from(Level), names, texts)
firings = st.builds(RuleFired, times, names, numbers, names, texts)
facts = st.builds(FactChange, times, names, st.booleans(), numbers, names, texts)
goals = st.builds(GoalTransition, times, names, names, names, names, names, names, names, texts)
actions = st.builds(PlanActionTransition, times, names, names, names, names, names, names)
skills = st.builds(SkillStatus, times, names, names, texts, numbers, names)
uids = st.builds("{}::{}".format, names, names)
writes = st.builds(InterfaceWrite, times, uids, values)
messages = st.builds(InterfaceMessage, times, uids, names, numbers, names, names, values)
calls = st.builds(PlannerCall, times, *[names] * 4, texts, texts, names, numbers, numbers, texts, texts)
loops = st.builds(LoopTime, times, numbers, numbers)
graphs = st.builds(NavGraphRead, times, names, st.dictionaries(names, values), st.dictionaries(names, values))
events: st.SearchStrategy[Event] = st.one_of(
    log_lines, firings, facts, goals, actions, skills, writes, messages, calls, loops, graphs
)
