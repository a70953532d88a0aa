"""The tables of the parser equal lark's tables of the grammar."""

from __future__ import annotations

import pytest

from cxbridge.executive.pddl.build import _NODES, _SECTIONS, SyntaxBuilder
from cxbridge.executive.pddl.grammar import TABLES_FILE, load_tables


def test_tables_equal_tables_of_grammar() -> None:
    pytest.importorskip("lark", reason="lark makes the tables")
    from tests.grammars import format_tables, make_tables

    made = format_tables(make_tables())
    assert made == TABLES_FILE.read_text(encoding="utf-8"), "run python -m tests.grammars"


def test_every_rule_has_method_or_row() -> None:
    wanted = {rule.build for rule in load_tables().rules if rule.build}
    rows = {*_SECTIONS, *_NODES}
    assert {name for name in wanted - rows if not hasattr(SyntaxBuilder, name)} == set()
    assert rows <= wanted
