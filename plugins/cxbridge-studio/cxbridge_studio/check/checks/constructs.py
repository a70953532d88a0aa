"""Check for constructs that CLIPS drops, with the position of the wrong word."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final

from cxbridge.clipstext.condition import OBJECT, condition_of, patterns
from cxbridge.clipstext.syntax import Definition, SyntaxNode, literal, read, without_module
from cxbridge.executive.host.loading import Diagnostic
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.agent.names import NameKind, Use
from cxbridge_studio.agent.top_level import top_level_lists
from cxbridge_studio.agent.unclosed import describe_unclosed
from cxbridge_studio.check.agent import Agent, ClipsFile
from cxbridge_studio.check.findings import Code, Finding, Severity, SourcePlace
from cxbridge_studio.check.losses import LossFinder

UNCLOSED: Final = Code(
    "CX201",
    Severity.ERROR,
    "a parenthesis never closes",
    "CLIPS reads the rest of the file as a part of this construct, and drops it: the "
    "constructs after it do "
    "not exist.",
)
TEMPLATE: Final = Code(
    "CX202",
    Severity.ERROR,
    "unknown deftemplate",
    "No file that is loaded before this construct defines the deftemplate. CLIPS drops the construct.",
)
SLOT: Final = Code(
    "CX203",
    Severity.ERROR,
    "unknown slot",
    "The deftemplate has no slot of this name. CLIPS drops the construct.",
)
FUNCTION: Final = Code(
    "CX204",
    Severity.ERROR,
    "unknown function",
    "Neither CLIPS, nor a feature that the agent asks for, nor a file that is loaded before defines "
    "the function. CLIPS "
    "drops the construct.",
)
GLOBAL: Final = Code(
    "CX205",
    Severity.ERROR,
    "unknown global variable",
    "No file that is loaded before this construct has a defglobal of this name. CLIPS drops the construct.",
)
ARGUMENTS: Final = Code(
    "CX206",
    Severity.ERROR,
    "wrong number or type of arguments",
    "The function takes another number, or other types, of arguments. CLIPS drops the construct.",
)
VARIABLE: Final = Code(
    "CX207",
    Severity.ERROR,
    "a variable has no value",
    "Nothing binds the variable before it is used: often it is misspelt. CLIPS drops the construct.",
)
CONSTRUCT: Final = Code(
    "CX209",
    Severity.ERROR,
    "CLIPS cannot read this",
    "CLIPS drops the construct, or does not read the file at all; the message is its own.",
)

CODES: Final = (UNCLOSED, TEMPLATE, SLOT, FUNCTION, GLOBAL, ARGUMENTS, VARIABLE, CONSTRUCT)

_OF_CLIPS: Final = {
    "TMPLTDEF1": SLOT,
    "EXPRNPSR3": FUNCTION,
    "GLOBLPSR1": GLOBAL,
    "ARGACCES1": ARGUMENTS,
    "ARGACCES2": ARGUMENTS,
    "TMPLTDEF2": ARGUMENTS,
    "PRCCODE3": VARIABLE,
    "ANALYSIS4": VARIABLE,
    "UNCLOSED": UNCLOSED,
}

_LITERAL = "CSTRNCHK1"  # CLIPS' error code for a literal that its slot does not allow

_QUOTED = re.compile(r"'([^']+)'")
_VARIABLE = re.compile(r"\$?\?[\w*-]+")


@dataclass(frozen=True, slots=True)
class _Known:
    """The names that the agent defines, in dropped constructs, too."""

    constructs: dict[str, set[str]]

    @classmethod
    def of(cls, files: Iterable[ClipsFile]) -> _Known:
        names_of_kinds: dict[str, set[str]] = {}
        for file in files:
            for construct in _all_constructs(file):
                names_of_kinds.setdefault(construct.kind, set()).add(construct.name)
        return cls(names_of_kinds)

    def names(self, *kinds: str) -> set[str]:
        """Return the names of all constructs of these kinds."""
        return {name for kind in kinds for name in self.constructs.get(kind, ())}


def check(agent: Agent) -> Iterator[Finding]:
    """Yield the constructs that CLIPS drops for a mistake, not those that follow from another mistake."""
    known, losses = _Known.of(agent.files), LossFinder(agent.usage, agent.is_of_core)
    dropped = {
        d.construct.partition(" ")[2] for file in agent.files for d in file.diagnostics if d.construct
    } | {name for file in agent.files for name in _lost(file)}
    for file in agent.files:
        unclosed = any(d.code == "UNCLOSED" for d in file.diagnostics)
        for diagnostic in file.diagnostics:
            if unclosed and diagnostic.code != "UNCLOSED" and _last_of(file, diagnostic):
                continue  # CLIPS' own error for the unclosed parenthesis
            if diagnostic.code == "UNCLOSED":
                yield from _unclosed(agent, file, diagnostic, losses)
                continue
            finding = _finding(agent, file, diagnostic, known)
            if finding is not None and not _follows(finding, diagnostic, dropped, known):
                yield _with_lost(agent, file, diagnostic, finding, losses)


def _with_lost(
    agent: Agent, file: ClipsFile, diagnostic: Diagnostic, finding: Finding, losses: LossFinder
) -> Finding:
    """Return the finding with the losses of its construct added to the message."""
    kind, _, name = diagnostic.construct.partition(" ")
    construct = agent.usage.find(str(file.path), kind, without_module(name))
    lost = losses.of([construct]) if construct is not None else None
    return replace(finding, message=f"{finding.message}; {lost}") if lost else finding


def _finding(agent: Agent, file: ClipsFile, diagnostic: Diagnostic, known: _Known) -> Finding | None:
    construct = _construct(file, diagnostic)
    code = _OF_CLIPS.get(diagnostic.code, CONSTRUCT)
    prefix = f"{diagnostic.construct}: " if diagnostic.construct else ""
    unknown = _unknown_template(agent, construct) if construct is not None else None
    if construct is not None and unknown is not None:
        name = unknown.head
        hint = did_you_mean(name, known.names("deftemplate"))
        return Finding(TEMPLATE, file.place(unknown), f"{prefix}there is no deftemplate '{name}'", hint)
    if construct is not None and code is CONSTRUCT:
        is_value = diagnostic.code == _LITERAL
        finding = (_refused if is_value else _ordered)(agent, file, construct, prefix)
        if finding is not None:
            return finding
    word = _unknown_global(agent, construct) if code is GLOBAL else _word(construct, diagnostic)
    if code is VARIABLE and word is not None and word.text.startswith("?*"):
        code = GLOBAL
    place = SourcePlace(str(file.path), diagnostic.line or 0) if word is None else file.place(word)
    text = "" if word is None else word.text
    if code is FUNCTION:
        return Finding(
            code, place, f"{prefix}there is no function '{text}'", _function_hint(agent, text, known)
        )
    if code is GLOBAL:
        return Finding(code, place, f"{prefix}there is no global variable {text}", _global_hint(agent, text))
    if code is SLOT:
        return Finding(code, place, f"{prefix}{_slot_message(diagnostic)}", _slot_hint(agent, diagnostic))
    return Finding(code, place, f"{prefix}{diagnostic.message} [{diagnostic.code}]")


def _refused(agent: Agent, file: ClipsFile, construct: Definition, prefix: str) -> Finding | None:
    """Return the finding for the first literal that its slot does not allow."""
    for fact in _facts(construct):
        template = without_module(fact.head)
        for slot in fact.arguments:
            allowed = agent.allowed(template, slot.head)
            for value in slot.arguments if allowed else ():
                if (word := literal(value)) and word not in allowed:
                    known = f"it can be: {', '.join(sorted(allowed))}"
                    near = did_you_mean(word, allowed)
                    message = f"{prefix}the slot '{slot.head}' of '{template}' cannot be {word}"
                    return Finding(
                        CONSTRUCT, file.place(value), message, f"{near} {known}" if near else known
                    )
    return None


def _facts(construct: Definition) -> list[SyntaxNode]:
    """Return the patterns and the asserted facts of a construct, in the order of the text."""
    facts = [node for call in construct.node.walk() if call.head == "assert" for node in call.arguments]
    facts += [ce.node for ce in patterns(condition_of(construct.node))]
    facts += construct.node.arguments[1:] if construct.kind == "deffacts" else ()
    return sorted(facts, key=lambda node: node.start)


def _defines(file: ClipsFile, template: str) -> bool:
    return any(each.kind == "deftemplate" and each.name == template for each in file.constructs)


def _ordered(agent: Agent, file: ClipsFile, construct: Definition, prefix: str) -> Finding | None:
    """Return the finding for the first pattern or fact without slots whose deftemplate has slots."""
    for fact in _facts(construct):
        name = without_module(fact.head)
        if name in agent.deftemplates and any(item.items is None for item in fact.arguments):
            hint = f"write ({name} (SLOT VALUE) ...)"
            if any(each.is_core and _defines(each, name) for each in agent.files):
                hint = "it is one of the CX core's: use another name"
            message = f"{prefix}the deftemplate '{name}' has slots, and here are fields without one"
            return Finding(CONSTRUCT, file.place(fact), message, hint)
    return None


# ---- positions


def _construct(file: ClipsFile, diagnostic: Diagnostic) -> Definition | None:
    kind, _, name = diagnostic.construct.partition(" ")
    matches = [each for each in file.constructs if (each.kind, each.name) == (kind, without_module(name))]
    if len(matches) > 1 and diagnostic.line:
        matches = [each for each in matches if each.line <= (diagnostic.line or 0)] or matches
    return matches[-1] if matches else None


def _word(construct: Definition | None, diagnostic: Diagnostic) -> SyntaxNode | None:
    """Return the node that a message quotes, or the construct if the message quotes none."""
    if construct is None:
        return None
    quoted = _QUOTED.findall(diagnostic.message)
    wanted = quoted[:1] or _VARIABLE.findall(diagnostic.message)[:1]
    wanted += [
        f"?*{name[1:]}*" for name in wanted if name.startswith("?")
    ]  # in conditions, CLIPS' messages name a global without the asterisks
    for node in construct.node.walk():
        if node.items is None and node.start > construct.node.start and node.text in wanted:
            return node
    return construct.node


# ---- parentheses


def _unclosed(agent: Agent, file: ClipsFile, diagnostic: Diagnostic, losses: LossFinder) -> Iterator[Finding]:
    """Yield a finding at the open list of each unclosed construct."""
    for part in top_level_lists(file.text):
        if part.closed:
            continue
        description = describe_unclosed(part.text, part.start, file.lines, file.text, agent.slots)
        is_first = file.lines.at(part.start) == diagnostic.line
        lost = losses.swallowed(str(file.path), part.start) if is_first else None
        message = description.message + (f"; {lost}" if lost else "")
        yield Finding(UNCLOSED, file.place_at(description.start), message, description.hint)


def _lost(file: ClipsFile) -> Iterator[str]:
    """Yield the names of the unclosed construct and of all constructs after it."""
    line = next((d.line for d in file.diagnostics if d.code == "UNCLOSED"), None)
    if line is None:
        return
    for row in file.text.splitlines()[line - 1 :]:
        match = re.match(r"\(def\w+\s+([^\s()\";]+)", row)
        if match:
            yield without_module(match[1])


def _all_constructs(file: ClipsFile) -> Iterator[Definition]:
    """Yield the constructs of a file, including those after an unclosed parenthesis."""
    yield from file.constructs
    line = next((d.line for d in file.diagnostics if d.code == "UNCLOSED"), None)
    if line is None:
        return
    rest = file.text.splitlines(keepends=True)[line:]
    start = next((number for number, row in enumerate(rest) if row.startswith("(def")), len(rest))
    text = "".join(rest[start:])
    for node in read(text):
        if node.arguments:
            yield Definition(node.head, without_module(node.arguments[0].text), line + start + 1, node)


def _last_of(file: ClipsFile, diagnostic: Diagnostic) -> bool:
    line = next(d.line for d in file.diagnostics if d.code == "UNCLOSED")
    return diagnostic.line is None or line is None or diagnostic.line >= line


# ---- consequences of other mistakes


def _follows(finding: Finding, diagnostic: Diagnostic, dropped: set[str], known: _Known) -> bool:
    """Return whether the construct is dropped only because a construct it needs is dropped."""
    names = _QUOTED.findall(finding.message) + _QUOTED.findall(diagnostic.message)
    return any(name in dropped and name in known.names("deftemplate", "deffunction") for name in names)


# ---- names


def _unknown_template(agent: Agent, construct: Definition) -> SyntaxNode | None:
    """Return the first pattern with slots whose deftemplate does not exist."""
    known = agent.deftemplates | {OBJECT}
    for ce in patterns(condition_of(construct.node)):
        if not ce.is_ordered and without_module(ce.template) not in known:
            return ce.node
    return None


def _function_hint(agent: Agent, name: str, known: _Known) -> str:
    functions = ("deffunction", "defgeneric")
    later = [
        file for file in agent.files if any(c.kind in functions and c.name == name for c in file.constructs)
    ]
    if later:
        return f"{later[0].path.name} defines it, and is loaded later: load it before"
    feature = agent.feature_with(name)
    if feature:
        return f"it is a function of the feature {feature}: request it in stage-1 of the spec"
    return did_you_mean(name, known.names("deffunction", "defgeneric", "defmethod"))


def _unknown_global(agent: Agent, construct: Definition | None) -> SyntaxNode | None:
    """Return the first undefined global variable: CLIPS' message does not name it."""
    global_names = agent.env.eval("(get-defglobal-list *)")
    known = {without_module(str(name)) for name in (global_names if isinstance(global_names, tuple) else ())}
    for node in () if construct is None else construct.node.walk():
        if node.text.startswith(("?*", "$?*")) and node.text.strip("$?*") not in known:
            return node
    return None if construct is None else construct.node


def _global_hint(agent: Agent, text: str) -> str:
    known = agent.model.names(NameKind.GLOBAL, Use.DEFINED)
    hint = did_you_mean(text.strip("$?*"), known)
    return re.sub(r"mean (.*)\?", r"mean ?*\1*?", hint)


def _slot_message(diagnostic: Diagnostic) -> str:
    slot, template = [*_QUOTED.findall(diagnostic.message), "?", "?"][:2]
    return f"the deftemplate '{template}' has no slot '{slot}'"


def _slot_hint(agent: Agent, diagnostic: Diagnostic) -> str:
    slot, template = [*_QUOTED.findall(diagnostic.message), "", ""][:2]
    slots = agent.env.eval(f"(deftemplate-slot-names {template})") if template else ()
    names = [str(each) for each in slots] if isinstance(slots, tuple) else []
    return did_you_mean(slot, names) or f"it has: {', '.join(names)}"
