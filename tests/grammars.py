"""Makes the tables of the grammars with lark: ``python -m tests.grammars``.

The package has a grammar of PDDL and a grammar of the templates of action mappings.
"""

from __future__ import annotations

import json
from typing import Any

import msgspec

from cxbridge.executive.pddl.grammar import GRAMMAR_FILE, START_SYMBOLS, TABLES_FILE, Rule, Tables
from cxbridge.skiller import templates


def make_tables() -> Tables:
    """Return the tables of the present grammar. Needs lark."""
    from lark import Lark
    from lark.lexer import Lexer, PatternStr

    class NoLexer(Lexer):
        """Read nothing. With a lexer of lark's, ``strict`` would need one more package."""

        def __init__(self, _conf: object) -> None:
            """Do nothing."""

        def lex(self, _state: object, _parser_state: object) -> Any:
            """Read nothing."""

    text = GRAMMAR_FILE.read_text(encoding="utf-8")
    lark = Lark(text, parser="lalr", lexer=NoLexer, start=list(START_SYMBOLS), strict=True)
    rules = tuple(map(_rule, lark.rules))
    starts, states = _states(lark)
    words = [terminal for terminal in lark.terminals if terminal.name not in lark.ignore_tokens]
    texts = {
        terminal.name: terminal.pattern.value
        for terminal in words
        if isinstance(terminal.pattern, PatternStr)
    }
    patterns = {terminal.name: terminal for terminal in words if terminal.name not in texts}
    (comment,) = (terminal.pattern.value for terminal in lark.terminals if terminal.name == "COMMENT")
    return Tables(
        comment=comment,
        cuts={name: terminal.pattern.to_regexp() for name, terminal in patterns.items() if terminal.priority},
        keywords={text: name for name, text in texts.items()},
        words={
            name: terminal.pattern.to_regexp() for name, terminal in patterns.items() if not terminal.priority
        },
        rules=rules,
        starts=starts,
        states=_without_detours(states, rules),
    )


def _rule(rule: Any) -> Rule:
    """Return a rule of lark. Strings in the grammar have no value, and lists are helpers of lark's."""
    symbols = list(enumerate(rule.expansion))
    kept = tuple(place for place, symbol in symbols if not (symbol.is_term and symbol.filter_out))
    spread = tuple(place for place, symbol in symbols if not symbol.is_term and symbol.name.startswith("__"))
    result = rule.origin.name
    is_plain = result.startswith("_") or (rule.options.expand1 and not rule.alias)
    return Rule(result, len(rule.expansion), kept, spread, "" if is_plain else rule.alias or result)


def _states(lark: Any) -> tuple[dict[str, int], list[dict[str, int]]]:
    """Return the first states, and the actions of each state."""
    table = lark.parser.parser._parse_table
    rules = {rule: number for number, rule in enumerate(lark.rules)}
    # lark's order of states is another in each process
    order = {state: number for number, (_, state) in enumerate(sorted(table.start_states.items()))}
    states: list[dict[str, int]] = []
    for state in (waiting := list(order)):
        row: dict[str, int] = {}
        for symbol, (_, target) in sorted(table.states[state].items()):
            if target not in rules and target not in order:
                order[target] = len(order)
                waiting.append(target)
            row[symbol] = -1 - rules[target] if target in rules else order[target]
        states.append(row)
    return {name: order[state] for name, state in sorted(table.start_states.items())}, states


def _without_detours(states: list[dict[str, int]], rules: tuple[Rule, ...]) -> tuple[dict[str, int], ...]:
    """Return states without those whose only action is the renaming of a symbol."""

    def behind(row: dict[str, int], target: int) -> int:
        while target >= 0 and len(actions := set(states[target].values())) == 1:
            (action,) = actions
            rule = rules[-1 - action] if action < 0 else None
            if rule is None or rule.size != 1 or rule.build or rule.result.startswith("__"):
                break
            target = row[rule.result]
        return target

    return tuple({symbol: behind(row, target) for symbol, target in row.items()} for row in states)


def format_tables(tables: Tables) -> str:
    """Return the tables in the format of the file: one element per line, for readable changes."""
    parts = []
    for name in tables.__struct_fields__:
        value = getattr(tables, name)
        if isinstance(value, str):
            parts.append(f'"{name}":{_json(value)}')
            continue
        items = (
            [f"{_json(key)}:{_json(item)}" for key, item in value.items()]
            if isinstance(value, dict)
            else [_json(item) for item in value]
        )
        first, last = "{}" if isinstance(value, dict) else "[]"
        parts.append(f'"{name}":{first}\n' + ",\n".join(items) + f"\n{last}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def make_terminals() -> dict[str, str]:
    """Return the regular expressions of the terminals of ``templates.lark``. Needs lark."""
    return {
        terminal.name: terminal.pattern.to_regexp()
        for terminal in template_parser().terminals
        if terminal.name in _TERMINALS
    }


_TERMINALS = ("PLACEHOLDER", "NAME")


def template_parser() -> Any:
    """Return lark's parser of ``templates.lark``; its start symbols are ``template`` and ``placeholder``."""
    from lark import Lark

    text = templates.GRAMMAR.read_text(encoding="utf-8")
    return Lark(text, parser="lalr", lexer="contextual", start=["template", "placeholder"])


def format_terminals(terminals: dict[str, str]) -> str:
    """Return the terminals as the file has them."""
    return json.dumps(terminals, indent=1) + "\n"


def _json(value: object) -> str:
    return json.dumps(value, default=msgspec.structs.astuple, separators=(",", ":"))


if __name__ == "__main__":
    TABLES_FILE.write_text(format_tables(make_tables()), encoding="utf-8")
    templates.TERMINALS.write_text(format_terminals(make_terminals()), encoding="utf-8")
