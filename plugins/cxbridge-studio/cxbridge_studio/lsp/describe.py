"""Hover texts: describes a name in Markdown, by its definition, documentation and uses."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Final

from cxbridge.clipstext.syntax import SyntaxNode, read_nodes
from cxbridge_studio.agent.lua import find_documentation
from cxbridge_studio.agent.model import FileMention
from cxbridge_studio.agent.names import Mention, Name, NameKind, SourceFile, Use
from cxbridge_studio.lsp.session import Session, find_comment_above

_MAX_LINES: Final = 40  # limit of the lines of code in a hover text: more would not fit on a screen
_LANGUAGES: Final = {".clp": "clips", ".pddl": "pddl", ".xml": "xml", ".lua": "lua", ".yaml": "yaml"}
_COMMENT_ELEMENT: Final = re.compile(r"<comment>([^<]*)</comment>")
_FIELD_ELEMENT: Final = re.compile(r"<(?:field|message)\b[^>]*>([^<]*)")


def describe_name(session: Session, file: SourceFile, mention: Mention) -> str:
    """Return the hover text of a name as Markdown; empty for an unknown name."""
    name = mention.name
    definitions = session.filter_visible(session.model.find_definitions(name), file.path)
    paragraphs: list[str] = []
    if definitions:  # in CLIPS, the last definition of a name replaces the earlier definitions
        paragraphs += _describe_definition(definitions[-1], name)
    elif name.kind is NameKind.FUNCTION:
        paragraphs += _describe_builtin_function(session, name)
    elif name.kind in (NameKind.TEMPLATE, NameKind.SLOT):
        paragraphs += _describe_builtin_template(session, name)
    elif name.kind is NameKind.GOAL_CLASS:  # goal classes have no definition
        paragraphs.append(f"goal class **{name.text}**")
    return "\n\n".join(filter(None, (*paragraphs, _summarize_uses(session, name)))) if paragraphs else ""


def _describe_definition(definition: FileMention, name: Name) -> Iterator[str]:
    """Yield the paragraphs about a definition; some may be empty."""
    file, mention = definition
    describers: Mapping[NameKind, Callable[[FileMention], Iterator[str]]] = {
        NameKind.SKILL: _describe_skill,
        NameKind.ARGUMENT: _describe_argument,
        NameKind.INTERFACE: _describe_interface,
        NameKind.FIELD: _describe_field,
        NameKind.MESSAGE: _describe_field,
    }
    describer = describers.get(mention.name.kind)
    if describer is not None:
        yield from describer(definition)
    elif name.kind in (
        NameKind.CONSTANT,
        NameKind.OBJECT_TYPE,
        NameKind.PREDICATE,
        NameKind.PARAMETER,
        NameKind.GLOBAL,
        NameKind.SLOT,
    ):
        yield _format_code(file, _find_enclosing_list(file, mention))
        yield _find_trailing_comment(file, mention.end)
        yield f"of the deftemplate **{name.owner}**" if name.kind is NameKind.SLOT else ""
    else:
        yield from _describe_construct(definition)
    yield f"*{name.kind.value}*, {Path(file.path).name}:{file.lines.line_at(mention.start)}"


def _describe_construct(definition: FileMention) -> Iterator[str]:
    """Yield the code, the documentation and the comment of a construct; the latter two may be empty.

    The code is the condition of a rule, the head of a function, or the text of another construct.
    """
    file, mention = definition
    placed_piece = file.piece_at(mention.start)
    if placed_piece is None:
        return
    text = placed_piece.piece.text
    if placed_piece.piece.keyword == "defrule":
        text = text.partition("=>")[0].rstrip()
    nodes = read_nodes(text, close=True)
    if placed_piece.piece.keyword in ("deffunction", "defmethod") and nodes:
        text = _format_function_head(nodes[0])
    yield _format_code(file, text)
    yield _find_documentation(nodes[0]) if nodes and file.path.endswith(".clp") else ""
    yield find_comment_above(file.text, placed_piece.start)


def _format_function_head(function: SyntaxNode) -> str:
    """Return a function without its body."""
    parameters = next((node for node in function.arguments if node.items is not None), None)
    return function.source[function.start : parameters.end] + " ...)" if parameters else function.text


def _find_documentation(construct: SyntaxNode) -> str:
    """Return the documentation string after the name of a construct; empty if there is none."""
    text = construct.arguments[1].text if len(construct.arguments) > 1 else ""
    return text.strip('"') if text.startswith('"') else ""


def _describe_skill(definition: FileMention) -> Iterator[str]:
    yield f"skill **{definition.mention.name.text}**"
    yield f"```\n{find_documentation(definition.file.text)}\n```"


def _describe_argument(definition: FileMention) -> Iterator[str]:
    line = definition.file.text[definition.mention.start :].partition("\n")[0]
    yield f"`{definition.mention.name.text}`{line[len(definition.mention.name.text) :]}"
    yield f"argument of the skill **{definition.mention.name.owner}**"


def _describe_interface(definition: FileMention) -> Iterator[str]:
    comment_match = _COMMENT_ELEMENT.search(definition.file.text)
    yield f"interface **{definition.mention.name.text}**"
    yield " ".join(comment_match[1].split()) if comment_match else ""
    fields = [
        f"- `{mention.name.text}`: {_format_field(definition.file, mention)}"
        for mention in definition.file.mentions
        if mention.name.kind is NameKind.FIELD
    ]
    yield "\n".join(fields)


def _describe_field(definition: FileMention) -> Iterator[str]:
    yield f"`{definition.mention.name.text}` of **{definition.mention.name.owner}**: " + _format_field(
        *definition
    )


def _format_field(file: SourceFile, mention: Mention) -> str:
    """Return the comment and the type of a field or message in an interface definition."""
    start = file.text.rfind("<", 0, mention.start)
    match = _FIELD_ELEMENT.match(file.text, start)
    type_match = re.search(r'type="(\w+)"', match[0]) if match else None
    comment = " ".join(match[1].split()) if match else ""
    return f"{comment} ({type_match[1]})" if type_match else comment


def _describe_builtin_function(session: Session, name: Name) -> Iterator[str]:
    function = session.knowledge.functions.get(name.text)
    if function is not None and function.is_python:
        owner = f"the feature `{function.feature}`" if function.feature else "the CLIPS host"
        yield f"**{name.text}**: a function of {owner}, {function.argument_count_text}"
        yield function.documentation
    elif function is not None:
        yield f"**{name.text}**: a function of CLIPS"


def _describe_builtin_template(session: Session, name: Name) -> Iterator[str]:
    """Yield the deftemplate of a template, or of a slot, that a feature defines instead of a file."""
    template = name.owner if name.kind is NameKind.SLOT else name.text
    slots = session.knowledge.templates.get(template)
    if slots is not None and (name.kind is NameKind.TEMPLATE or name.text in slots):
        yield _make_code_block(
            "clips", f"(deftemplate {template} " + " ".join(f"(slot {slot})" for slot in slots) + ")"
        )


def _summarize_uses(session: Session, name: Name) -> str:
    """Return how often each use occurs, such as "matched 3 times, asserted once"."""
    counts = Counter(
        mention.use.value
        for _, mention in session.model.find_mentions(name)
        if mention.use is not Use.DEFINED
    )
    return ", ".join(f"{use} {count} times" if count > 1 else f"{use} once" for use, count in counts.items())


# ---- text


def _find_enclosing_list(file: SourceFile, mention: Mention) -> str:
    """Return the innermost list around a definition; for a global variable, the rest of its line.

    The text is empty in XML and outside of lists.
    """
    start = file.text.rfind("(", 0, mention.start + 1)
    placed_piece = file.piece_at(mention.start)
    if placed_piece is None or start < placed_piece.start or file.path.endswith(".xml"):
        return ""
    nodes = read_nodes(file.text[start : placed_piece.end], close=True)
    text = nodes[0].text if nodes else ""
    if placed_piece.piece.keyword == "defglobal":
        end = file.text.find("\n", mention.start)
        text = file.text[mention.start : None if end < 0 else end]
    return text


def _find_trailing_comment(file: SourceFile, offset: int) -> str:
    """Return the comment after a semicolon in the rest of a line; empty without one, or with a string."""
    line = file.text[offset:].partition("\n")[0]
    # In a line with a string, a semicolon may be part of the string.
    return line.partition(";")[2].strip() if ";" in line and '"' not in line else ""


def _format_code(file: SourceFile, text: str) -> str:
    code_lines = text.splitlines()
    visible_lines = [*code_lines[:_MAX_LINES], "..."] if len(code_lines) > _MAX_LINES else code_lines
    return _make_code_block(_LANGUAGES.get(Path(file.path).suffix, ""), "\n".join(visible_lines))


def _make_code_block(language: str, text: str) -> str:
    return f"```{language}\n{text}\n```"
