"""The feature `pddl-parser`: PDDL domains and formulas as facts. Facts: docs/pddl.md."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from cxbridge.errors import CxbridgeError, PddlError
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.executive.host.values import Value
from cxbridge.executive.problem.numbers import PddlNumbers

if TYPE_CHECKING:
    from cxbridge.executive.pddl import Domain, FactToAssert


class PddlParserFeature(Feature):
    """Gives ``parse-pddl-domain`` and ``parse-pddl-formula``."""

    name = "pddl-parser"

    def __init__(self) -> None:
        self._domains: dict[str, Domain] = {}

    def domain_of(self, env: ClipsEnvironment) -> Domain | None:
        """Return the domain that an environment parsed last; None when it parsed none."""
        return self._domains.get(env.name)

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        """Forget the environment's domain."""
        self._domains.pop(env.name, None)

    def init_context(self, env: ClipsEnvironment) -> None:
        """Define the functions."""
        # the parser is only for agents that ask for it
        from cxbridge.executive.pddl import (  # noqa: PLC0415
            domain_facts,
            formula_facts,
            parse_domain,
            parse_formula,
        )

        log = env.bus.logger(f"PDDLCLIPS|{env.name}")

        def domain(path: str) -> None:
            try:
                data = Path(path).read_bytes()
                env.bus.emit_source("pddl", env.name, path, data, kind="domain")
                parsed = parse_domain(data.decode("utf-8-sig", "surrogateescape"), path)
                rows = domain_facts(parsed, warn=lambda problem: log.warn(str(problem)))
            except OSError as error:
                text = f"cannot read it: {error.strerror}"
                file, line = env.loader.place_of_executing()
                mistake = Diagnostic(file or path, line, "", "PDDL", f"the domain {path}: {text}")
                env.loader.report(mistake, f"Failed to parse domain: {path}: {text}", log)
            except PddlError as error:
                mistake = Diagnostic(
                    error.file or path, error.line, "", "PDDL", error.message, error.hint or ""
                )
                env.loader.report(mistake, f"Failed to parse domain: {error}", log)
            else:
                self._domains[env.name] = parsed
                numbers.follow(parsed)
                _assert_rows(env, rows)

        def formula(text: str, identifier: str) -> None:
            try:
                rows = formula_facts(parse_formula(text), identifier)
            except PddlError as error:
                log.error(f"Failed to parse formula: {error}")
            else:
                _assert_rows(env, rows)

        numbers = PddlNumbers(env, lambda: self.domain_of(env), log.error)
        env.define("parse-pddl-domain", domain, 1, types="*;sy")
        env.define("parse-pddl-formula", formula, 2, types="*;sy;sy")


def _assert_rows(env: ClipsEnvironment, rows: Iterable[FactToAssert]) -> None:
    """Assert the rows in order; one that CLIPS refuses is logged, the others still come."""
    for row in rows:
        slots = {slot: _fields(value) for slot, value in row.slots.items()}
        try:
            env.assert_fact(row.template, slots)
        except CxbridgeError as error:
            env.log.error(str(error))


def _fields(value: str | tuple[str, ...]) -> Value:
    """Return what CLIPS reads the text as: symbols, and numbers where a constant is one."""
    return clips_scalar(value) if isinstance(value, str) else tuple(clips_scalar(item) for item in value)
