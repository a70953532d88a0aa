"""Handlers of the requests and notifications of the protocol.

The handlers convert between the types of the protocol (lsprotocol) and those of the studio. The parameter
``ls`` is the language server, as in the examples of pygls.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import PurePath
from typing import Any, Final

from lsprotocol import types as lsp
from pygls.capabilities import get_capability
from pygls.exceptions import JsonRpcInvalidParams

from cxbridge.errors import CxbridgeError
from cxbridge_studio.agent.layout import indent_clips
from cxbridge_studio.agent.model import FileMention
from cxbridge_studio.agent.names import Mention, NameKind, SourceFile
from cxbridge_studio.lsp import navigation
from cxbridge_studio.lsp.completion import complete
from cxbridge_studio.lsp.describe import describe_name
from cxbridge_studio.lsp.positions import path_to_uri
from cxbridge_studio.lsp.server import AgentServer
from cxbridge_studio.lsp.symbols import OutlineSymbol, find_symbols, make_outline

# Editors ask for a completion after these characters.
_TRIGGER_CHARACTERS: Final = ["(", "?", "*", ":", "{", '"']
# patterns of the word before the cursor, which a completion replaces, by the suffix of the file
_WORD_PATTERNS: Final = {".clp": re.compile(r"[^\s()\"&|~;]*\Z"), ".pddl": re.compile(r"[?:\w-]*\Z")}
_DEFAULT_WORD_PATTERN: Final = re.compile(r"[\w/.-]*\Z")
_WATCHED_FILES: Final = "**/*.{clp,pddl,yaml,yml,lua,xml}"

# the protocol's kinds for the kinds of names, for which editors show icons
_SYMBOL_KINDS: Final[Mapping[NameKind, lsp.SymbolKind]] = {
    NameKind.RULE: lsp.SymbolKind.Event,
    NameKind.TEMPLATE: lsp.SymbolKind.Struct,
    NameKind.SLOT: lsp.SymbolKind.Field,
    NameKind.FUNCTION: lsp.SymbolKind.Function,
    NameKind.GLOBAL: lsp.SymbolKind.Variable,
    NameKind.FACTS: lsp.SymbolKind.Object,
    NameKind.MODULE: lsp.SymbolKind.Module,
    NameKind.ACTION: lsp.SymbolKind.Method,
    NameKind.PARAMETER: lsp.SymbolKind.TypeParameter,
    NameKind.PREDICATE: lsp.SymbolKind.Property,
    NameKind.OBJECT_TYPE: lsp.SymbolKind.Class,
    NameKind.CONSTANT: lsp.SymbolKind.Constant,
    NameKind.SKILL: lsp.SymbolKind.Function,
    NameKind.ARGUMENT: lsp.SymbolKind.TypeParameter,
    NameKind.INTERFACE: lsp.SymbolKind.Interface,
    NameKind.FIELD: lsp.SymbolKind.Field,
    NameKind.MESSAGE: lsp.SymbolKind.Method,
    NameKind.FILE: lsp.SymbolKind.File,
}
_COMPLETION_KINDS: Final[Mapping[NameKind, lsp.CompletionItemKind]] = {
    NameKind.TEMPLATE: lsp.CompletionItemKind.Struct,
    NameKind.SLOT: lsp.CompletionItemKind.Field,
    NameKind.FIELD: lsp.CompletionItemKind.Field,
    NameKind.FUNCTION: lsp.CompletionItemKind.Function,
    NameKind.GLOBAL: lsp.CompletionItemKind.Variable,
    NameKind.ACTION: lsp.CompletionItemKind.Method,
    NameKind.SKILL: lsp.CompletionItemKind.Function,
    NameKind.INTERFACE: lsp.CompletionItemKind.Interface,
    NameKind.FILE: lsp.CompletionItemKind.File,
}


def make_server(options: Mapping[str, Any] | None = None) -> AgentServer:
    """Return a server with all handlers registered; see :class:`AgentServer`."""
    server = AgentServer(options)
    for method, handler in _HANDLERS.items():
        server.feature(method, _HANDLER_OPTIONS.get(method))(partial(handler, server))
    return server


def _handle_initialized(ls: AgentServer, _params: lsp.InitializedParams) -> None:
    ls.start()
    capability = "workspace.did_change_watched_files.dynamic_registration"
    if get_capability(ls.client_capabilities, capability, default=False):
        options = lsp.DidChangeWatchedFilesRegistrationOptions([lsp.FileSystemWatcher(_WATCHED_FILES)])
        method = lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES
        # the server registers the method only once, so the method also serves as the id of the registration
        ls.client_register_capability(lsp.RegistrationParams([lsp.Registration(method, method, options)]))


# ---- requests about the name at a position


def _answer_about_mention(
    answer: Callable[[AgentServer, SourceFile, Mention, Any], Any], ls: AgentServer, params: Any
) -> Any:
    """Return the answer about the name at a position; None if there is no name or the file is unknown.

    :param answer: returns the answer from the server, the file, the mention and the parameters.
    :raises JsonRpcInvalidParams: if the answer fails, such as for a name that cannot be renamed.
    """
    file = ls.find_file(params.text_document.uri)
    mention = None if file is None else file.mention_at(ls.positions.to_offset(file, params.position))
    try:
        return None if file is None or mention is None else answer(ls, file, mention, params)
    except CxbridgeError as error:
        raise JsonRpcInvalidParams(str(error)) from None


def _make_locations(ls: AgentServer, mentions: Iterable[FileMention]) -> list[lsp.Location]:
    return [ls.positions.to_location(file, mention.start, mention.end) for file, mention in mentions]


def _hover(ls: AgentServer, file: SourceFile, mention: Mention, _params: lsp.HoverParams) -> lsp.Hover | None:
    text = describe_name(ls.session, file, mention)
    hover_range = ls.positions.to_range(file, mention.start, mention.end)
    return lsp.Hover(lsp.MarkupContent(lsp.MarkupKind.Markdown, text), hover_range) if text else None


def _find_definitions(
    ls: AgentServer, file: SourceFile, mention: Mention, _params: lsp.DefinitionParams
) -> list[lsp.Location]:
    return _make_locations(ls, navigation.find_definitions(ls.session, file, mention))


def _find_references(
    ls: AgentServer, _file: SourceFile, mention: Mention, params: lsp.ReferenceParams
) -> list[lsp.Location]:
    include_definitions = params.context.include_declaration
    references = navigation.find_references(ls.session, mention, include_definitions=include_definitions)
    return _make_locations(ls, references)


def _prepare_rename(
    ls: AgentServer, file: SourceFile, mention: Mention, _params: lsp.PrepareRenameParams
) -> lsp.Range:
    navigation.check_renamable(ls.session, mention)
    return ls.positions.to_range(file, mention.start, mention.end)


def _rename(
    ls: AgentServer, _file: SourceFile, mention: Mention, params: lsp.RenameParams
) -> lsp.WorkspaceEdit:
    edits: dict[str, list[lsp.TextEdit]] = {}
    for file, reference in navigation.find_renamed_mentions(ls.session, mention, params.new_name):
        # marks around a name, as in ?*NAME* and MODULE::NAME, are part of the mention and stay
        new_text = file.text[reference.start : reference.end].replace(reference.name.text, params.new_name)
        edit = lsp.TextEdit(ls.positions.to_range(file, reference.start, reference.end), new_text)
        edits.setdefault(path_to_uri(file.path), []).append(edit)
    return lsp.WorkspaceEdit(changes=edits)


# ---- requests about a file


def _answer_about_file(
    answer: Callable[[AgentServer, SourceFile, Any], Any], ls: AgentServer, params: Any
) -> Any:
    """Return the answer about a file; None if the file is unknown.

    :param answer: returns the answer from the server, the file and the parameters.
    """
    file = ls.find_file(params.text_document.uri)
    return None if file is None else answer(ls, file, params)


def _complete(ls: AgentServer, file: SourceFile, params: lsp.CompletionParams) -> lsp.CompletionList:
    offset = ls.positions.to_offset(file, params.position)
    pattern = _WORD_PATTERNS.get(PurePath(file.path).suffix, _DEFAULT_WORD_PATTERN)
    line = file.text[file.text.rfind("\n", 0, offset) + 1 : offset]
    word = pattern.findall(line)[0]  # without a word, the pattern matches the empty text at the end
    replaced_range = ls.positions.to_range(file, offset - len(word), offset)
    items = [
        lsp.CompletionItem(
            proposal.text,
            kind=_COMPLETION_KINDS.get(proposal.kind, lsp.CompletionItemKind.Value)
            if proposal.kind
            else None,
            detail=proposal.detail or None,
            # an edit with its range, since editors would replace only a part of a word such as ?fact:slot
            text_edit=lsp.TextEdit(replaced_range, proposal.text),
        )
        for proposal in complete(ls.session, file, offset)
    ]
    return lsp.CompletionList(is_incomplete=False, items=items)


def _outline(
    ls: AgentServer, file: SourceFile, _params: lsp.DocumentSymbolParams
) -> list[lsp.DocumentSymbol]:
    return [_convert_symbol(ls, file, symbol) for symbol in make_outline(file)]


def _convert_symbol(ls: AgentServer, file: SourceFile, symbol: OutlineSymbol) -> lsp.DocumentSymbol:
    name = symbol.mention.name
    return lsp.DocumentSymbol(
        name.text,
        _SYMBOL_KINDS.get(name.kind, lsp.SymbolKind.Object),
        ls.positions.to_range(file, symbol.start, symbol.end),
        ls.positions.to_range(file, symbol.mention.start, symbol.mention.end),
        detail=name.kind.value,
        children=[_convert_symbol(ls, file, child) for child in symbol.children],
    )


def _describe_firings(ls: AgentServer, file: SourceFile, _params: lsp.CodeLensParams) -> list[lsp.CodeLens]:
    """Return a text about the firings of each rule in the last recording; none without a recording."""
    knowledge = ls.session.knowledge
    lenses = []
    for mention in (symbol.mention for symbol in make_outline(file) if knowledge.recording):
        if mention.name.kind is NameKind.RULE:
            count = knowledge.firings.get(mention.name.text, 0)
            times = {0: "never fired", 1: "fired once"}.get(count, f"fired {count} times")
            symbol_range = ls.positions.to_range(file, mention.start, mention.end)
            lenses.append(lsp.CodeLens(symbol_range, lsp.Command(f"{times} in {knowledge.recording}", "")))
    return lenses


def _format(ls: AgentServer, file: SourceFile, _params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
    whole_file = ls.positions.to_range(file, 0, len(file.text))
    is_clips = file.path.endswith(".clp")
    return [lsp.TextEdit(whole_file, indent_clips(file.text))] if is_clips else []


def _find_workspace_symbols(ls: AgentServer, params: lsp.WorkspaceSymbolParams) -> list[lsp.WorkspaceSymbol]:
    return [
        lsp.WorkspaceSymbol(
            ls.positions.to_location(file, mention.start, mention.end),
            mention.name.text,
            _SYMBOL_KINDS.get(mention.name.kind, lsp.SymbolKind.Object),
        )
        for file, mention in find_symbols(ls.session, params.query)
    ]


# by method, a request or a notification: the function that gets the server and the parameters
_HANDLERS: Final[Mapping[str, Callable[..., Any]]] = {
    lsp.INITIALIZE: AgentServer.read_parameters,
    lsp.INITIALIZED: _handle_initialized,
    lsp.SHUTDOWN: AgentServer.end,
    lsp.TEXT_DOCUMENT_DID_OPEN: partial(AgentServer.update_document, is_saved=True),
    lsp.TEXT_DOCUMENT_DID_CHANGE: partial(AgentServer.update_document, is_saved=False),
    lsp.TEXT_DOCUMENT_DID_SAVE: AgentServer.handle_save,
    lsp.TEXT_DOCUMENT_DID_CLOSE: AgentServer.handle_close,
    lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES: AgentServer.handle_disk_changes,
    lsp.TEXT_DOCUMENT_HOVER: partial(_answer_about_mention, _hover),
    lsp.TEXT_DOCUMENT_DEFINITION: partial(_answer_about_mention, _find_definitions),
    lsp.TEXT_DOCUMENT_REFERENCES: partial(_answer_about_mention, _find_references),
    lsp.TEXT_DOCUMENT_PREPARE_RENAME: partial(_answer_about_mention, _prepare_rename),
    lsp.TEXT_DOCUMENT_RENAME: partial(_answer_about_mention, _rename),
    lsp.TEXT_DOCUMENT_COMPLETION: partial(_answer_about_file, _complete),
    lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL: partial(_answer_about_file, _outline),
    lsp.TEXT_DOCUMENT_CODE_LENS: partial(_answer_about_file, _describe_firings),
    lsp.TEXT_DOCUMENT_FORMATTING: partial(_answer_about_file, _format),
    lsp.WORKSPACE_SYMBOL: _find_workspace_symbols,
}
_HANDLER_OPTIONS: Final[Mapping[str, Any]] = {
    lsp.TEXT_DOCUMENT_COMPLETION: lsp.CompletionOptions(trigger_characters=_TRIGGER_CHARACTERS),
    lsp.TEXT_DOCUMENT_RENAME: lsp.RenameOptions(prepare_provider=True),
    lsp.TEXT_DOCUMENT_CODE_LENS: lsp.CodeLensOptions(resolve_provider=False),
}
