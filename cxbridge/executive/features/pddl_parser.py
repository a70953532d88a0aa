"""The feature `pddl-parser`: PDDL domains and formulas as facts. Facts: docs/pddl.md."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.environment import ClipsEnvironment
from cxbridge.executive.manager import Feature
from cxbridge.executive.pddl import FactRow, domain_facts, formula_facts, parse_domain, parse_formula
from cxbridge.executive.values import Symbol, Value


class PddlParserFeature(Feature):
    """Gives ``parse-pddl-domain`` and ``parse-pddl-formula``."""

    name = "pddl-parser"

    def init_context(self, env: ClipsEnvironment) -> None:
        """Define the functions."""
        log = env.bus.logger(f"PDDLCLIPS|{env.name}")

        def domain(path: str) -> None:
            try:
                text = Path(path).read_text(encoding="utf-8", errors="surrogateescape")
                rows = domain_facts(parse_domain(text, path))
            except OSError as error:
                log.error(f"Failed to parse domain: {path}: cannot read it: {error.strerror}")
            except PddlError as error:
                log.error(f"Failed to parse domain: {error}")
            else:
                _assert_rows(env, rows)

        def formula(text: str, identifier: str) -> None:
            try:
                rows = formula_facts(parse_formula(text), identifier)
            except PddlError as error:
                log.error(f"Failed to parse formula: {error}")
            else:
                _assert_rows(env, rows)

        env.define("parse-pddl-domain", domain, 1, types="*;sy")
        env.define("parse-pddl-formula", formula, 2, types="*;sy;sy")


def _assert_rows(env: ClipsEnvironment, rows: Iterable[FactRow]) -> None:
    """Assert the rows in order; one that CLIPS refuses is told of, the others still come."""
    for row in rows:
        slots = {slot: _symbols(value) for slot, value in row.slots.items()}
        try:
            env.assert_fact(row.template, slots)
        except CxbridgeError as error:
            env.log.error(str(error))


def _symbols(value: str | tuple[str, ...]) -> Value:
    return Symbol(value) if isinstance(value, str) else tuple(Symbol(item) for item in value)
