"""Checks for constructs that CLIPS drops, and finds the position of the wrong word.

CLIPS has loaded the files before, and its diagnostics are the mistakes. The check finds the word that each
diagnostic is about, and omits mistakes that are only consequences of an earlier mistake.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.clipstext.syntax import Definition, SyntaxNode, literal, without_module
from cxbridge.executive.host.loading import UNCLOSED as UNCLOSED_CODE
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.condition import OBJECT, find_patterns, parse_condition
from cxbridge_studio.agent.names import NameKind, Use
from cxbridge_studio.agent.unclosed import describe_unclosed
from cxbridge_studio.check.agent import Agent, ClipsFile
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace

UNCLOSED_CONSTRUCT: Final = Code(
    "CX201",
    Severity.ERROR,
    "a parenthesis never closes",
    "CLIPS reads the rest of the file as a part of this construct, and drops the construct: the constructs "
    "after it do not exist.",
)
UNKNOWN_TEMPLATE: Final = Code(
    "CX202",
    Severity.ERROR,
    "unknown deftemplate",
    "No file that is loaded before this construct defines the deftemplate. CLIPS drops the construct.",
)
UNKNOWN_SLOT: Final = Code(
    "CX203",
    Severity.ERROR,
    "unknown slot",
    "The deftemplate has no slot of this name. CLIPS drops the construct.",
)
UNKNOWN_FUNCTION: Final = Code(
    "CX204",
    Severity.ERROR,
    "unknown function",
    "Neither CLIPS, nor a feature that the agent asks for, nor a file that is loaded before defines the "
    "function. CLIPS drops the construct.",
)
UNKNOWN_GLOBAL: Final = Code(
    "CX205",
    Severity.ERROR,
    "unknown global variable",
    "No file that is loaded before this construct has a defglobal of this name. CLIPS drops the construct.",
)
WRONG_ARGUMENTS: Final = Code(
    "CX206",
    Severity.ERROR,
    "wrong number or type of arguments",
    "The function needs arguments of another number or of other types, or the slot needs exactly one value. "
    "CLIPS drops the construct.",
)
UNBOUND_VARIABLE: Final = Code(
    "CX207",
    Severity.ERROR,
    "a variable has no value",
    "Nothing binds the variable before its first use: often the variable is misspelt. CLIPS drops the "
    "construct.",
)
UNREADABLE_CONSTRUCT: Final = Code(
    "CX209",
    Severity.ERROR,
    "CLIPS cannot read this",
    "CLIPS drops the construct, or does not read the file at all; the message is that of CLIPS.",
)

CODES: Final = (
    UNCLOSED_CONSTRUCT,
    UNKNOWN_TEMPLATE,
    UNKNOWN_SLOT,
    UNKNOWN_FUNCTION,
    UNKNOWN_GLOBAL,
    WRONG_ARGUMENTS,
    UNBOUND_VARIABLE,
    UNREADABLE_CONSTRUCT,
)

# The codes of findings by CLIPS' error code. All other errors have the code UNREADABLE_CONSTRUCT.
_CODES_BY_CLIPS_CODE: Final = {
    "TMPLTDEF1": UNKNOWN_SLOT,
    "EXPRNPSR3": UNKNOWN_FUNCTION,
    "GLOBLPSR1": UNKNOWN_GLOBAL,
    "ARGACCES1": WRONG_ARGUMENTS,
    "ARGACCES2": WRONG_ARGUMENTS,
    "TMPLTDEF2": WRONG_ARGUMENTS,
    "PRCCODE3": UNBOUND_VARIABLE,
    "ANALYSIS4": UNBOUND_VARIABLE,
    UNCLOSED_CODE: UNCLOSED_CONSTRUCT,
}

_QUOTED_NAME = re.compile(r"'([^']+)'")
_VARIABLE = re.compile(r"\$?\?[\w*-]+")


def check(agent: Agent) -> Iterator[Finding]:
    """Yield a finding for each construct that CLIPS drops because of a mistake in the construct itself."""
    dropped_names = {
        diagnostic.construct.partition(" ")[2]
        for file in agent.files
        for diagnostic in file.diagnostics
        if diagnostic.construct
    }
    dropped_names |= {name for file in agent.files for name in _find_swallowed_names(file)}
    for file in agent.files:
        line = _find_unclosed_line(file)
        for diagnostic in file.diagnostics:
            if diagnostic.code == UNCLOSED_CODE:
                yield from _find_unclosed(agent, file)
            # The check omits errors after an unclosed parenthesis: they are consequences.
            elif line is None or (diagnostic.line is not None and diagnostic.line < line):
                finding = _make_finding(agent, file, diagnostic)
                if not _is_consequence(agent, finding, diagnostic, dropped_names):
                    yield finding


def _find_defined_names(agent: Agent, *keywords: str) -> set[str]:
    """Return the names that constructs of these kinds define, including dropped constructs."""
    return {
        construct.name
        for construct in agent.usage.constructs
        if construct.keyword in keywords and construct.name
    }


def _make_finding(agent: Agent, file: ClipsFile, diagnostic: Diagnostic) -> Finding:
    """Return the finding for a diagnostic, at the wrong word if the word can be found."""
    construct = _find_construct(file, diagnostic)
    code = _CODES_BY_CLIPS_CODE.get(diagnostic.code, UNREADABLE_CONSTRUCT)
    prefix = f"{diagnostic.construct}: " if diagnostic.construct else ""
    word: SyntaxNode | None = None
    if construct is not None:
        if (pattern := _find_unknown_template(agent, file, construct)) is not None:
            hint = did_you_mean(pattern.head, _find_defined_names(agent, "deftemplate"))
            message = f"{prefix}there is no deftemplate '{pattern.head}'"
            if pattern.head in agent.late_interfaces:
                message += " until a rule opens the interface"
                hint = f"add {pattern.head} to the entry blackboard-preload of the spec"
            return Finding(UNKNOWN_TEMPLATE, file.place(pattern), message, hint)
        if code is UNREADABLE_CONSTRUCT:
            # CLIPS has this code for a literal that its slot does not allow.
            is_forbidden_literal = diagnostic.code == "CSTRNCHK1"
            explain = _explain_forbidden_literal if is_forbidden_literal else _explain_missing_slots
            if (finding := explain(agent, file, construct, prefix)) is not None:
                return finding
        word = (
            _find_unknown_global(agent, construct)
            if code is UNKNOWN_GLOBAL
            else _find_word(construct, diagnostic)
        )
    place = SourcePlace(str(file.path), diagnostic.line or 0) if word is None else file.place(word)
    name = "" if word is None or word.items is not None else word.text
    # CLIPS reports an undefined global variable in a condition as a variable without a value.
    if code is UNKNOWN_GLOBAL or (code is UNBOUND_VARIABLE and name.startswith("?*")):
        message = f"{prefix}there is no global variable {name}".rstrip()
        return Finding(UNKNOWN_GLOBAL, place, message, _make_global_hint(agent, name))
    if code is UNKNOWN_FUNCTION:
        message = f"{prefix}there is no function '{name}'"
        return Finding(code, place, message, _make_function_hint(agent, file, name))
    if code is UNKNOWN_SLOT:
        # Some messages of CLIPS quote fewer names: the missing names are empty.
        slot, template = [*_QUOTED_NAME.findall(diagnostic.message), "", ""][:2]
        names = agent.eval_words(f"(deftemplate-slot-names {template})") if template else []
        message = f"{prefix}the deftemplate '{template or '?'}' has no slot '{slot or '?'}'"
        return Finding(code, place, message, did_you_mean(slot, names, f"it has: {', '.join(names)}"))
    # A code of cxbridge, such as LIMIT, has no digits, and users look up the codes of CLIPS only.
    clips_code = "" if diagnostic.code.isalpha() else f" [{diagnostic.code}]"
    return Finding(code, place, f"{prefix}{diagnostic.message}{clips_code}")


def _explain_forbidden_literal(
    agent: Agent, file: ClipsFile, construct: Definition, prefix: str
) -> Finding | None:
    """Return the finding for the first literal that its slot does not allow; None if there is none."""
    for fact in _find_facts(construct):
        template = without_module(fact.head)
        for slot in fact.arguments:
            allowed_values = agent.allowed_values(template, slot.head)
            for value in slot.arguments if allowed_values else ():
                if (word := literal(value)) and word not in allowed_values:
                    values_text = ", ".join(sorted(allowed_values))
                    hint = f"{did_you_mean(word, allowed_values)} it can be: {values_text}"
                    message = f"{prefix}the slot '{slot.head}' of '{template}' cannot be {word}"
                    return Finding(UNREADABLE_CONSTRUCT, file.place(value), message, hint.strip())
    return None


def _find_facts(construct: Definition) -> list[SyntaxNode]:
    """Return the patterns and the asserted facts of a construct, in the order of the text."""
    facts = [node for call in construct.node.walk() if call.head == "assert" for node in call.arguments]
    facts += [ce.node for ce in find_patterns(parse_condition(construct.node))]
    facts += construct.node.arguments[1:] if construct.kind == "deffacts" else ()
    return sorted(facts, key=lambda node: node.start)


def _explain_missing_slots(
    agent: Agent, file: ClipsFile, construct: Definition, prefix: str
) -> Finding | None:
    """Return the finding for the first pattern or fact with fields outside of its deftemplate's slots.

    Return None if there is none.
    """
    for fact in _find_facts(construct):
        name = without_module(fact.head)
        if name in agent.deftemplates and any(argument.items is None for argument in fact.arguments):
            is_of_core = any(
                source.is_core and (definition.kind, definition.name) == ("deftemplate", name)
                for source in agent.files
                for definition in source.constructs
            )
            return Finding(
                UNREADABLE_CONSTRUCT,
                file.place(fact),
                f"{prefix}the deftemplate '{name}' has slots, but these fields are not in slots",
                "it is a deftemplate of the CX core: use another name"
                if is_of_core
                else f"write ({name} (SLOT VALUE) ...)",
            )
    return None


# ---- positions


def _find_construct(file: ClipsFile, diagnostic: Diagnostic) -> Definition | None:
    """Return the construct of a diagnostic; None if the file has no closed construct of this name.

    Of several constructs with the name, the last construct before the line of the diagnostic counts.
    """
    kind, _, name = diagnostic.construct.partition(" ")
    matches = [
        definition
        for definition in file.constructs
        if (definition.kind, definition.name) == (kind, without_module(name))
    ]
    if len(matches) > 1 and diagnostic.line:
        matches = [definition for definition in matches if definition.line <= diagnostic.line] or matches
    return matches[-1] if matches else None


def _find_word(construct: Definition, diagnostic: Diagnostic) -> SyntaxNode:
    """Return the node of the word that a diagnostic quotes, or of the construct if it has no such word."""
    words = _QUOTED_NAME.findall(diagnostic.message)[:1] or _VARIABLE.findall(diagnostic.message)[:1]
    # CLIPS' messages about conditions name a global without the asterisks.
    words += [f"?*{word[1:]}*" for word in words if word.startswith("?")]
    inner_nodes = (node for node in construct.node.walk() if node.items is None)
    return next((node for node in inner_nodes if node.text in words), construct.node)


# ---- parentheses


def _find_unclosed(agent: Agent, file: ClipsFile) -> Iterator[Finding]:
    """Yield a finding for each unclosed construct, at the list that is probably left open."""
    for start, piece in file.source.pieces:
        if not piece.is_closed:
            lines = file.source.lines
            description = describe_unclosed(piece.text, start, lines, file.text, agent.slots)
            place = SourcePlace.at(str(file.path), lines, description.start)
            yield Finding(UNCLOSED_CONSTRUCT, place, description.message, description.hint)


def _find_unclosed_line(file: ClipsFile) -> int | None:
    """Return the line of the unclosed construct; None without an unclosed construct."""
    lines = (diagnostic.line for diagnostic in file.diagnostics if diagnostic.code == UNCLOSED_CODE)
    return next(lines, None)


def _find_swallowed_names(file: ClipsFile) -> Iterator[str]:
    """Yield the names of the unclosed construct and of all later constructs in the file."""
    line = _find_unclosed_line(file)
    return (
        construct.name
        for construct in file.all_constructs
        if line is not None and construct.name and construct.place().line >= line
    )


# ---- consequences of other mistakes


def _is_consequence(agent: Agent, finding: Finding, diagnostic: Diagnostic, dropped_names: set[str]) -> bool:
    """Return whether CLIPS drops a construct only because of a dropped definition that the construct needs.

    The definition is a deftemplate or a deffunction that the finding or the diagnostic quotes.
    """
    names = _QUOTED_NAME.findall(finding.message) + _QUOTED_NAME.findall(diagnostic.message)
    return not _find_defined_names(agent, "deftemplate", "deffunction").isdisjoint(
        dropped_names.intersection(names)
    )


# ---- names


def _find_unknown_template(agent: Agent, file: ClipsFile, construct: Definition) -> SyntaxNode | None:
    """Return the first pattern with slots that has no deftemplate, or only that of a late interface.

    Return None if there is none. A deftemplate that a later file defines counts, too.
    """
    late_interfaces = {name for name, paths in agent.late_interfaces.items() if file.path in paths}
    templates = agent.deftemplates - late_interfaces | {OBJECT}
    slotted_patterns = (ce for ce in find_patterns(parse_condition(construct.node)) if not ce.is_ordered)
    return next((ce.node for ce in slotted_patterns if without_module(ce.template) not in templates), None)


def _make_function_hint(agent: Agent, file: ClipsFile, name: str) -> str:
    """Return where an unknown function is defined, or a similar name; empty without either."""
    functions = ("deffunction", "defgeneric")
    for source in agent.files:
        if any(definition.kind in functions and definition.name == name for definition in source.constructs):
            if source is file:
                return "it is defined later in this file: define it earlier"
            return f"{source.path.name} defines it, and is loaded later: load it earlier"
    if feature := agent.find_feature(name):
        return f"it is a function of the feature {feature}: request it in stage-1 of the spec"
    return did_you_mean(name, _find_defined_names(agent, *functions, "defmethod"))


def _find_unknown_global(agent: Agent, construct: Definition) -> SyntaxNode:
    """Return the first undefined global variable of a construct: CLIPS' message does not name it.

    If all are defined by now, return the only global variable, or of several the construct.
    """
    defined_globals = set(map(without_module, agent.eval_words("(get-defglobal-list *)")))
    globals_ = [node for node in construct.node.walk() if node.text.startswith(("?*", "$?*"))]
    fallback = globals_[0] if len({node.text for node in globals_}) == 1 else construct.node
    return next((node for node in globals_ if node.text.strip("$?*") not in defined_globals), fallback)


def _make_global_hint(agent: Agent, variable: str) -> str:
    name, names = variable.strip("$?*"), agent.model.find_names(NameKind.GLOBAL, Use.DEFINED)
    if name in names:
        return "its defglobal comes later, or CLIPS drops it"
    hint = did_you_mean(name, names)
    # The model has the names of global variables without their asterisks.
    return re.sub(r"mean (.*)\?", r"mean ?*\1*?", hint)
