"""Finds the definitions and references of a name, and renames names."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from cxbridge.errors import CxbridgeError
from cxbridge_studio.agent.model import FileMention
from cxbridge_studio.agent.names import Mention, Name, NameKind, SourceFile, Use
from cxbridge_studio.lsp.session import Session

# a word without the characters that separate or mark words in the files; only later characters may be `*`
_NEW_NAME: Final = re.compile(r"[^\s()\"';&|~?*<:,=][^\s()\"';&|~?<:,=]*")
# kinds of names that cannot be renamed, since code outside of the agent's files also uses the names
_FIXED_KINDS: Final = frozenset(
    {
        NameKind.FILE,
        NameKind.FEATURE,
        NameKind.INTERFACE,
        NameKind.FIELD,
        NameKind.MESSAGE,
        NameKind.SPEC,
    }
)


def find_definitions(session: Session, file: SourceFile, mention: Mention) -> list[FileMention]:
    """Return the definitions of a name, or the assertions of a goal class or an action without a definition.

    :param file: the file that contains the mention.
    """
    name = mention.name
    if name.kind is NameKind.FILE:
        return _find_files(session, file, name)
    definitions = session.model.find_definitions(name)
    # in a CLIPS file the action of a parameter may be unknown: then the parameters of all actions count
    if not definitions and name.kind is NameKind.PARAMETER and not name.owner:
        definitions = [
            definition
            for definition in session.model.find_definitions_of_kind(NameKind.PARAMETER)
            if definition.mention.name.text == name.text
        ]
    if not definitions and name.kind in (NameKind.GOAL_CLASS, NameKind.ACTION):
        definitions = list(session.model.find_mentions(name, Use.ASSERTED))
    return session.filter_visible(definitions, file.path)


def _find_files(session: Session, file: SourceFile, name: Name) -> list[FileMention]:
    """Return the starts of the files with a name such as ``name.clp`` or ``folder/name.clp``."""
    path_parts = Path(name.text).parts
    files = [
        FileMention(source, Mention(name, Use.DEFINED, 0, 0))
        for source in session.model.files
        if Path(source.path).parts[-len(path_parts) :] == path_parts
    ]
    return session.filter_visible(files, file.path)


def find_references(
    session: Session, mention: Mention, *, include_definitions: bool = True
) -> list[FileMention]:
    """Return the mentions of a name in all files.

    :param include_definitions: whether to include the definitions of the name.
    """
    mentions = list(session.model.find_mentions(mention.name))
    if mention.name.kind is NameKind.FUNCTION:  # in the model, a call in an ordered fact looks like a slot
        calls = session.model.find_calls(mention.name.text)
        mentions += [call for call in calls if call.mention.name.kind is NameKind.SLOT]
    return [
        reference for reference in mentions if include_definitions or reference.mention.use is not Use.DEFINED
    ]


def find_renamed_mentions(session: Session, mention: Mention, new_name: str) -> list[FileMention]:
    """Return the mentions that a renaming changes.

    :raises CxbridgeError: if the name cannot be renamed, or the new name is invalid or already defined.
    """
    name = mention.name
    check_renamable(session, mention)
    if not _NEW_NAME.fullmatch(new_name):
        raise CxbridgeError(f"'{new_name}' cannot be the name of a {name.kind.value}")
    if session.model.is_defined(Name(name.kind, new_name, name.owner)):
        raise CxbridgeError(f"there is a {name.kind.value} '{new_name}' already")
    return find_references(session, mention)


def check_renamable(session: Session, mention: Mention) -> None:
    """Check that a name can be renamed.

    :raises CxbridgeError: if code outside of the agent's files also uses the name, if no file defines it, or
        if a file outside of the editor's folder defines it.
    """
    name = mention.name
    if name.kind in _FIXED_KINDS:
        raise CxbridgeError(f"the name of a {name.kind.value} is also used outside of the agent's files")
    definitions = session.model.find_definitions(name)
    if not definitions and name.kind is not NameKind.GOAL_CLASS:
        raise CxbridgeError(f"no file defines the {name.kind.value} '{name.text}'")
    if session.root is not None and any(
        not Path(definition.file.path).is_relative_to(session.root) for definition in definitions
    ):
        raise CxbridgeError(f"the {name.kind.value} '{name.text}' is defined outside of {session.root}")
