"""Completion: proposes the names that fit at the cursor."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import PurePath
from typing import Final, NamedTuple

from cxbridge.clipstext.syntax import read_nodes
from cxbridge.executive.pddl.ast import FORMULA_WORDS
from cxbridge_studio.agent.clips import (
    CONDITION_HEADS,
    CONSTRUCT_KINDS,
    FIRST_ARGUMENT_KINDS,
    SLOT_VALUE_KINDS,
)
from cxbridge_studio.agent.names import Name, NameKind, SourceFile, Use
from cxbridge_studio.agent.yaml import find_parent_keys
from cxbridge_studio.lsp.context import CursorContext, find_context, find_fact_template
from cxbridge_studio.lsp.session import Session


class Proposal(NamedTuple):
    """A proposed word.

    :param kind: the kind of a name; None for a keyword or a value.
    :param detail: a short description for the user.
    """

    text: str
    kind: NameKind | None
    detail: str = ""


# the action in: (plan-action (action-name goto)
_ACTION_NAME: Final = re.compile(r"\(action-name\s+([^\s()?]+)")
# the fact in: ?fact:slot
_SLOT_ACCESS: Final = re.compile(r"(\?[\w-]+):[^\s()]*\Z")
_CONSTRUCTS: Final = (*CONSTRUCT_KINDS, "defglobal")
_PDDL_KEYS: Final = (":parameters", ":precondition", ":effect", ":duration", ":condition")


def complete(session: Session, file: SourceFile, offset: int) -> list[Proposal]:
    """Return the proposals that fit at a position, sorted by their texts, and only one for each text."""
    completers: Mapping[str, Callable[[Session, SourceFile, int], Iterable[Proposal]]] = {
        ".clp": _complete_clips,
        ".yaml": _complete_yaml,
        ".yml": _complete_yaml,
        ".pddl": _complete_pddl,
    }
    completer = completers.get(PurePath(file.path).suffix)
    proposals = () if completer is None else completer(session, file, offset)
    return sorted({proposal.text: proposal for proposal in proposals if proposal.text}.values())


def _propose_defined(
    session: Session, file: SourceFile, kind: NameKind, owner: str | None = None
) -> Iterator[Proposal]:
    """Yield the defined names of a kind.

    :param owner: the owner of the names, such as the template of slots; None for any owner.
    """
    definitions = session.filter_visible(session.model.find_definitions_of_kind(kind, owner), file.path)
    for _, mention in definitions:
        yield Proposal(mention.name.text, kind, f"{kind.value} {mention.name.owner}".rstrip())


# ---- CLIPS


def _complete_clips(session: Session, file: SourceFile, offset: int) -> Iterable[Proposal]:
    context = find_context(file, offset)
    if context is None:
        return ()
    if not context.heads:
        return [Proposal(name, None, "construct") for name in _CONSTRUCTS] if context.is_at_head else ()
    if context.word.startswith(("?*", "$?*")):
        names = session.model.find_names(NameKind.GLOBAL, Use.DEFINED)
        return [Proposal(f"?*{name}*", NameKind.GLOBAL, "global") for name in names]
    if match := _SLOT_ACCESS.search(context.word):
        slots = _propose_slots(session, file, find_fact_template(context.text, match[1]))
        return [slot._replace(text=f"{match[1]}:{slot.text}") for slot in slots]
    if context.is_at_head:
        return _propose_heads(session, file, context)
    return _propose_arguments(session, file, context)


def _propose_heads(session: Session, file: SourceFile, context: CursorContext) -> Iterator[Proposal]:
    """Yield the words that can begin a list here."""
    if context.template and context.head in (context.template, "modify", "duplicate"):
        yield from _propose_slots(session, file, context.template)
    elif context.is_in_condition and (context.head == "defrule" or context.head in CONDITION_HEADS):
        yield from _propose_templates(session, file)
        yield from (Proposal(word, None, "condition") for word in (*CONDITION_HEADS, "test", "declare"))
    elif context.head in ("assert", "deffacts"):
        yield from _propose_templates(session, file)
    else:
        yield from _propose_defined(session, file, NameKind.FUNCTION)
        for name, function in session.knowledge.functions.items():
            yield Proposal(name, NameKind.FUNCTION, function.feature or "CLIPS")


def _propose_templates(session: Session, file: SourceFile) -> Iterator[Proposal]:
    yield from _propose_defined(session, file, NameKind.TEMPLATE)
    yield from _propose_defined(session, file, NameKind.INTERFACE)
    for name in session.knowledge.templates:
        yield Proposal(name, NameKind.TEMPLATE, "template")


def _propose_slots(session: Session, file: SourceFile, template: str) -> Iterator[Proposal]:
    yield from _propose_defined(session, file, NameKind.SLOT, template)
    yield from _propose_defined(session, file, NameKind.FIELD, template)
    for name in session.knowledge.templates.get(template, ()):
        yield Proposal(name, NameKind.SLOT, f"slot {template}")


def _propose_arguments(session: Session, file: SourceFile, context: CursorContext) -> Iterator[Proposal]:
    """Yield the words that can follow the head of the list."""
    head, template = context.head, context.template
    if template and head != template:
        kind = SLOT_VALUE_KINDS.get((template, head))
        if kind is not None:
            yield from _propose_names(session, file, kind)
        if (template, head) == ("plan-action", "param-names"):
            match = _ACTION_NAME.search(context.pattern)
            yield from _propose_defined(session, file, NameKind.PARAMETER, match[1] if match else None)
        yield from _propose_allowed_values(session, file, template, head)
    elif head in FIRST_ARGUMENT_KINDS:
        yield from _propose_names(session, file, FIRST_ARGUMENT_KINDS[head])
    # a list that begins with a variable is a member of a query, ((?fact TEMPLATE))
    elif head.startswith("?") and len(context.heads) > 1 and context.word == "":
        yield from _propose_templates(session, file)


def _propose_names(session: Session, file: SourceFile, kind: NameKind) -> Iterator[Proposal]:
    """Yield the defined names of a kind, and the used names of kinds that have no definitions."""
    yield from _propose_defined(session, file, kind)
    if kind in (NameKind.GOAL_CLASS, NameKind.FILE, NameKind.FEATURE):
        yield from (Proposal(name, kind, kind.value) for name in session.model.find_names(kind))


def _propose_allowed_values(
    session: Session, file: SourceFile, template: str, slot: str
) -> Iterator[Proposal]:
    definitions = session.filter_visible(
        session.model.find_definitions(Name(NameKind.TEMPLATE, template)), file.path
    )
    for definition, mention in definitions:
        placed_piece = definition.piece_at(mention.start)
        nodes = read_nodes(placed_piece.piece.text, close=True) if placed_piece else []
        for slot_node in nodes[0].arguments if nodes else ():
            if slot_node.arguments and slot_node.arguments[0].text == slot:
                for facet in slot_node.arguments[1:]:
                    if facet.head in ("allowed-values", "allowed-symbols"):
                        for value in facet.arguments:
                            yield Proposal(value.text, None, f"{template} {slot}")


# ---- YAML


def _complete_yaml(session: Session, file: SourceFile, offset: int) -> Iterator[Proposal]:
    start = file.text.rfind("\n", 0, offset) + 1
    line = file.text[start:offset]
    parent_keys = find_parent_keys(file, start + len(line) - len(line.lstrip()))
    parent_key, outer_key = [*parent_keys, "", ""][:2]  # empty at the top level
    key_match = re.match(r"\s*(?:- +)?([\w-]+):", line)  # a key, or the first key of a list's item
    key = key_match[1] if key_match else ""
    if "action-mapping" in (parent_key, outer_key):
        yield from _complete_mapping(
            session, file, line, parent_key if parent_key != "action-mapping" else ""
        )
    elif {"file", "files"} & {key, parent_key}:
        yield from (Proposal(name, NameKind.FILE, "file") for name in _list_clips_files(session))
    elif "blackboard-preload" in (key, parent_key):
        yield from _propose_defined(session, file, NameKind.INTERFACE)
    elif (parent_key, key) == ("stage-1", "name"):
        yield from _propose_names(session, file, NameKind.FEATURE)
    elif key == "spec":
        yield from _propose_defined(session, file, NameKind.SPEC)


def _complete_mapping(session: Session, file: SourceFile, line: str, action: str) -> Iterator[Proposal]:
    """Yield the proposals in an action mapping.

    :param line: the line up to the cursor.
    :param action: the action with a skill string that began in an earlier line; empty outside such a string.
    """
    key_match = re.match(r"\s*([\w-]+):\s", line)
    if not action and key_match is None:
        yield from _propose_defined(session, file, NameKind.ACTION)
        return
    action = key_match[1] if key_match else action
    if re.search(r"\?\([\w-]*\Z", line):  # in a placeholder: ?(to
        yield from _propose_defined(session, file, NameKind.PARAMETER, action)
    elif skill_match := re.search(r"([A-Za-z_]\w*)\s*\{[^}]*\Z", line):  # in the arguments: goto{pl
        yield from _propose_defined(session, file, NameKind.ARGUMENT, skill_match[1])
    else:
        yield from _propose_defined(session, file, NameKind.SKILL)


def _list_clips_files(session: Session) -> Iterator[str]:
    """Yield the names of CLIPS files as in specs: the name alone, and the name with its folder."""
    for path in (PurePath(file.path) for file in session.model.files if file.path.endswith(".clp")):
        yield path.name
        yield f"{path.parent.name}/{path.name}"


# ---- PDDL


def _complete_pddl(session: Session, file: SourceFile, offset: int) -> Iterator[Proposal]:
    placed_piece = file.piece_at(offset)
    preceding_text = file.text[placed_piece.start if placed_piece else 0 : offset]
    if re.search(r"\s-\s+[\w-]*\Z", preceding_text):  # a type: ?x - cup
        yield from _propose_defined(session, file, NameKind.OBJECT_TYPE)
    elif (
        re.search(r"\?[\w-]*\Z", preceding_text) and placed_piece and placed_piece.piece.name
    ):  # a variable: ?x
        parameters = _propose_defined(session, file, NameKind.PARAMETER, placed_piece.piece.name.text)
        yield from (proposal._replace(text=f"?{proposal.text}") for proposal in parameters)
    elif re.search(r"\(\s*[\w-]*\Z", preceding_text):  # the first word of a list: (at
        yield from _propose_defined(session, file, NameKind.PREDICATE)
        yield from (Proposal(word, None) for word in FORMULA_WORDS if word[0].isalpha())
    elif re.search(r":[\w-]*\Z", preceding_text):  # a key: :effect
        yield from (Proposal(word, None) for word in _PDDL_KEYS)
    else:
        yield from _propose_defined(session, file, NameKind.CONSTANT)
