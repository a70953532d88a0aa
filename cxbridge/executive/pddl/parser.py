"""The entry points: text or file to domain or formula."""

from __future__ import annotations

from pathlib import Path

from cxbridge.errors import PddlError
from cxbridge.executive.pddl.ast import Domain, Formula, Position
from cxbridge.executive.pddl.brackets import read_items
from cxbridge.executive.pddl.domains import DomainParser
from cxbridge.executive.pddl.errors import syntax_error
from cxbridge.executive.pddl.formulas import FormulaParser
from cxbridge.executive.pddl.semantics import DomainChecker


def load_domain(path: str | Path, *, fawkes_compat: bool = False) -> Domain:
    """Read a domain from a file; see :func:`parse_domain`.

    :raises PddlError: also when the file cannot be read.
    """
    return parse_domain(read_text(path, "domain"), str(path), fawkes_compat=fawkes_compat)


def read_text(path: str | Path, what: str) -> str:
    """Return the text of a file.

    :param what: what it should hold, to name it in the error.
    :raises PddlError: when it cannot be read, or is not UTF-8.
    """
    data = b""
    try:
        data = Path(path).read_bytes()
        return data.decode().removeprefix("\ufeff")
    except OSError as error:
        raise PddlError(
            f"cannot read the {what}: {(error.strerror or str(error)).lower()}", file=path
        ) from None
    except UnicodeDecodeError as error:
        raise PddlError(
            f"the file is not UTF-8 text: {error.reason}",
            file=path,
            line=data.count(b"\n", 0, error.start) + 1,
            hint="save it as UTF-8",
        ) from None


def parse_domain(text: str, file: str | Path = "", *, fawkes_compat: bool = False) -> Domain:
    """Return the domain that a text holds, checked.

    :param file: what to name in errors.
    :param fawkes_compat: accept and refuse what Fawkes' parser does where the two differ, see docs/pddl.md.
    :raises PddlSyntaxError: when the text is not a PDDL domain.
    :raises PddlSemanticError: when something in it is undeclared, or of another number or type.
    """
    items = read_items(text, str(file), close_last=fawkes_compat)
    domain = DomainParser(str(file), fawkes_compat=fawkes_compat).domain(items)
    DomainChecker(domain, fawkes_compat=fawkes_compat).check()
    return domain


def parse_formula(text: str, file: str | Path = "", *, fawkes_compat: bool = False) -> Formula:
    """Return the condition that a text holds; it is not checked against a domain.

    :raises PddlSyntaxError: when the text is not exactly one condition.
    """
    parser = FormulaParser(str(file), fawkes_compat=fawkes_compat)
    items = read_items(text, str(file))
    if not items:
        raise syntax_error("there is no formula in this text", Position(), str(file), "write (PREDICATE ...)")
    if len(items) > 1:
        raise syntax_error("there is text after the end of the formula", items[1].position, str(file))
    return parser.condition(items[0])
