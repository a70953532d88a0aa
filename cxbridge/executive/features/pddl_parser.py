"""The feature ``pddl-parser``: PDDL domains and formulas as facts, see docs/planning.md#pddl."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.config import Configuration
from cxbridge.errors import ConfigError, CxbridgeError, PddlError
from cxbridge.executive.feature import Feature
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.executive.problem.numbers import PddlNumbers

if TYPE_CHECKING:
    from cxbridge.executive.pddl import Domain, FactToAssert


STRICT: Final = "/clips-executive/pddl/strict"
"""The setting that selects Fawkes' PDDL parser."""

_FAWKES: Final = "fawkes"


def reads_as_fawkes(config: Configuration) -> bool:
    """Return whether to imitate Fawkes' PDDL parser, with its errors and the sections that it ignores.

    :raises ConfigError: if the value is neither ``fawkes`` nor empty.
    """
    value = config.get_str(STRICT, default="")
    if value not in ("", _FAWKES):
        raise ConfigError(f"{STRICT} cannot be '{value}'", hint=f"use {_FAWKES}, or remove the key")
    return value == _FAWKES


class PddlParserFeature(Feature):
    """Provides ``parse-pddl-domain`` and ``parse-pddl-formula``.

    :param as_fawkes: whether to imitate Fawkes' parser, see :func:`reads_as_fawkes`.
    """

    name = "pddl-parser"

    def __init__(self, *, as_fawkes: bool = False) -> None:
        self._as_fawkes = as_fawkes
        self._domains: dict[str, Domain] = {}

    def domain_of(self, env: ClipsEnvironment) -> Domain | None:
        """Return the last domain parsed in an environment, or None."""
        return self._domains.get(env.name)

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        self._domains.pop(env.name, None)

    def init_context(self, env: ClipsEnvironment) -> None:
        # imported on use: this module is imported in each run, but most agents do not parse PDDL
        from cxbridge.executive.pddl import (  # noqa: PLC0415
            domain_facts,
            formula_facts,
            parse_domain,
            parse_formula,
        )
        from cxbridge.executive.pddl.decoding import decode_text  # noqa: PLC0415

        log = env.bus.logger(f"PDDLCLIPS|{env.name}")
        numbers = PddlNumbers(env, lambda: self.domain_of(env), log.error)

        def warn(problem: PddlError) -> None:
            log.warn(str(problem))

        def assert_domain(path: str) -> None:
            try:
                # read as bytes, so that a recording contains even a file that cannot be decoded
                content = Path(path).read_bytes()
                env.bus.emit_source("pddl", env.name, path, content, kind="domain")
                domain = parse_domain(
                    decode_text(content, path), path, fawkes_compat=self._as_fawkes, warn=warn
                )
                facts = domain_facts(domain, fawkes_compat=self._as_fawkes, warn=warn)
            except OSError as error:
                reason = f"cannot be read: {error.strerror}"
                file, line = env.loader.executing_rule_location()
                mistake = Diagnostic(file or path, line, "", "PDDL", f"the domain {path} {reason}")
                env.loader.report(mistake, f"Failed to parse domain: {path} {reason}", log)
            except PddlError as error:
                mistake = Diagnostic(
                    error.file or path, error.line, "", "PDDL", error.message, error.hint or ""
                )
                env.loader.report(mistake, f"Failed to parse domain: {error}", log)
            else:
                self._domains[env.name] = domain
                numbers.load_rules(domain)
                _assert_facts(env, facts)

        def assert_formula(text: str, identifier: str) -> None:
            try:
                facts = formula_facts(parse_formula(text, fawkes_compat=self._as_fawkes), identifier)
            except PddlError as error:
                log.error(f"Failed to parse formula: {error}")
            else:
                _assert_facts(env, facts)

        env.define("parse-pddl-domain", assert_domain, 1, types="*;sy")
        env.define("parse-pddl-formula", assert_formula, 2, types="*;sy;sy")


def _assert_facts(env: ClipsEnvironment, facts: Iterable[FactToAssert]) -> None:
    """Assert facts in order. Log the facts that CLIPS refuses, and continue."""
    for fact in facts:
        slots = {
            slot: _clips_constant(value) if isinstance(value, str) else tuple(map(_clips_constant, value))
            for slot, value in fact.slots.items()
        }
        try:
            env.assert_fact(fact.template, slots)
        except CxbridgeError as error:
            env.log.error(str(error))


def _clips_constant(name: str) -> Value:
    """Return a PDDL name as a symbol, or as a number if CLIPS prints the number with the same text.

    Agents write ``(domain-object (name 1))`` with a number, which must equal the name. ``01`` stays a symbol,
    because CLIPS would print 1.
    """
    constant = clips_scalar(name)
    return constant if str(constant) == name else Symbol(name)
