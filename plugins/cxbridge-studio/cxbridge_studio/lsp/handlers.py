"""Handlers of the requests and notifications of the protocol.

The handlers convert between the types of the protocol (lsprotocol) and those of the studio.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import PurePath
from typing import Any, Final

from lsprotocol import types as lsp
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
    for kind, handler in _HANDLERS.items():
        server.feature(kind, _HANDLER_OPTIONS.get(kind))(handler)
    return server


# ---- life cycle and changes


def _handle_initialize(ls: AgentServer, params: lsp.InitializeParams) -> None:
    ls.read_parameters(params)


def _handle_initialized(ls: AgentServer, _params: lsp.InitializedParams) -> None:
    ls.start()
    workspace = ls.client_capabilities.workspace
    capability = workspace.did_change_watched_files if workspace else None
    if capability and capability.dynamic_registration:
        options = lsp.DidChangeWatchedFilesRegistrationOptions([lsp.FileSystemWatcher(_WATCHED_FILES)])
        kind = lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES
        ls.client_register_capability(lsp.RegistrationParams([lsp.Registration(kind, kind, options)]))


async def _handle_shutdown(ls: AgentServer, _params: None) -> None:
    await ls.end()


def _handle_open(ls: AgentServer, params: lsp.DidOpenTextDocumentParams) -> None:
    ls.update_document(params.text_document.uri, saved=True)


def _handle_change(ls: AgentServer, params: lsp.DidChangeTextDocumentParams) -> None:
    ls.update_document(params.text_document.uri, saved=False)


def _handle_save(ls: AgentServer, params: lsp.DidSaveTextDocumentParams) -> None:
    ls.handle_save(params.text_document.uri)


def _handle_close(ls: AgentServer, params: lsp.DidCloseTextDocumentParams) -> None:
    ls.handle_close(params.text_document.uri)


def _handle_watched_files(ls: AgentServer, params: lsp.DidChangeWatchedFilesParams) -> None:
    ls.handle_disk_changes(params.changes)


# ---- requests about a position


def _find_mention(ls: AgentServer, uri: str, position: lsp.Position) -> tuple[SourceFile, Mention] | None:
    """Return the file and the mention at a position; None if there is no name or the file is unknown."""
    file = ls.find_file(uri)
    mention = None if file is None else file.mention_at(ls.positions.to_offset(file, position))
    return None if file is None or mention is None else (file, mention)


def _make_locations(ls: AgentServer, mentions: Iterable[FileMention]) -> list[lsp.Location]:
    return [ls.positions.to_location(file, mention.start, mention.end) for file, mention in mentions]


def _handle_hover(ls: AgentServer, params: lsp.HoverParams) -> lsp.Hover | None:
    if (file_and_mention := _find_mention(ls, params.text_document.uri, params.position)) is None:
        return None
    file, mention = file_and_mention
    text = describe_name(ls.session, file, mention)
    hover_range = ls.positions.to_range(file, mention.start, mention.end)
    return lsp.Hover(lsp.MarkupContent(lsp.MarkupKind.Markdown, text), hover_range) if text else None


def _handle_definition(ls: AgentServer, params: lsp.DefinitionParams) -> list[lsp.Location]:
    if (file_and_mention := _find_mention(ls, params.text_document.uri, params.position)) is None:
        return []
    return _make_locations(ls, navigation.find_definitions(ls.session, *file_and_mention))


def _handle_references(ls: AgentServer, params: lsp.ReferenceParams) -> list[lsp.Location]:
    if (file_and_mention := _find_mention(ls, params.text_document.uri, params.position)) is None:
        return []
    include_definitions = params.context.include_declaration
    return _make_locations(
        ls,
        navigation.find_references(ls.session, file_and_mention[1], include_definitions=include_definitions),
    )


def _handle_completion(ls: AgentServer, params: lsp.CompletionParams) -> lsp.CompletionList:
    file = ls.find_file(params.text_document.uri)
    if file is None:
        return lsp.CompletionList(is_incomplete=False, items=[])
    offset = ls.positions.to_offset(file, params.position)
    pattern = _WORD_PATTERNS.get(PurePath(file.path).suffix, _DEFAULT_WORD_PATTERN)
    line = file.text[file.text.rfind("\n", 0, offset) + 1 : offset]
    word_match = pattern.search(line)
    word_length = len(word_match[0]) if word_match else 0
    replaced_range = ls.positions.to_range(file, offset - word_length, offset)
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


def _handle_prepare_rename(ls: AgentServer, params: lsp.PrepareRenameParams) -> lsp.Range | None:
    if (file_and_mention := _find_mention(ls, params.text_document.uri, params.position)) is None:
        return None
    file, mention = file_and_mention
    try:
        navigation.check_renamable(ls.session, mention)
    except CxbridgeError as error:
        raise JsonRpcInvalidParams(str(error)) from None
    return ls.positions.to_range(file, mention.start, mention.end)


def _handle_rename(ls: AgentServer, params: lsp.RenameParams) -> lsp.WorkspaceEdit | None:
    if (file_and_mention := _find_mention(ls, params.text_document.uri, params.position)) is None:
        return None
    try:
        mentions = navigation.find_renamed_mentions(ls.session, file_and_mention[1], params.new_name)
    except CxbridgeError as error:
        raise JsonRpcInvalidParams(str(error)) from None
    edits: dict[str, list[lsp.TextEdit]] = {}
    for file, mention in mentions:
        # marks around a name, as in ?*NAME* and MODULE::NAME, are part of the mention and stay
        new_text = file.text[mention.start : mention.end].replace(mention.name.text, params.new_name)
        edit = lsp.TextEdit(ls.positions.to_range(file, mention.start, mention.end), new_text)
        edits.setdefault(path_to_uri(file.path), []).append(edit)
    return lsp.WorkspaceEdit(changes=edits)


# ---- requests about a file


def _handle_document_symbols(ls: AgentServer, params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
    file = ls.find_file(params.text_document.uri)
    return [] if file is None else [_convert_symbol(ls, file, symbol) for symbol in make_outline(file)]


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


def _handle_workspace_symbols(
    ls: AgentServer, params: lsp.WorkspaceSymbolParams
) -> list[lsp.WorkspaceSymbol]:
    return [
        lsp.WorkspaceSymbol(
            ls.positions.to_location(file, mention.start, mention.end),
            mention.name.text,
            _SYMBOL_KINDS.get(mention.name.kind, lsp.SymbolKind.Object),
        )
        for file, mention in find_symbols(ls.session, params.query)
    ]


def _handle_code_lens(ls: AgentServer, params: lsp.CodeLensParams) -> list[lsp.CodeLens]:
    """Return a text about the firings of each rule in the last recording."""
    file = ls.find_file(params.text_document.uri)
    knowledge = ls.session.knowledge
    if file is None or not knowledge.recording:
        return []
    lenses = []
    for symbol in make_outline(file):
        if symbol.mention.name.kind is NameKind.RULE:
            count = knowledge.firings.get(symbol.mention.name.text, 0)
            times = {0: "never fired", 1: "fired once"}.get(count, f"fired {count} times")
            symbol_range = ls.positions.to_range(file, symbol.mention.start, symbol.mention.end)
            lenses.append(lsp.CodeLens(symbol_range, lsp.Command(f"{times} in {knowledge.recording}", "")))
    return lenses


def _handle_formatting(ls: AgentServer, params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
    file = ls.find_file(params.text_document.uri)
    if file is None or not file.path.endswith(".clp"):
        return []
    whole_file = ls.positions.to_range(file, 0, len(file.text))
    return [lsp.TextEdit(whole_file, indent_clips(file.text))]


_HANDLERS: Final[Mapping[str, Any]] = {
    lsp.INITIALIZE: _handle_initialize,
    lsp.INITIALIZED: _handle_initialized,
    lsp.SHUTDOWN: _handle_shutdown,
    lsp.TEXT_DOCUMENT_DID_OPEN: _handle_open,
    lsp.TEXT_DOCUMENT_DID_CHANGE: _handle_change,
    lsp.TEXT_DOCUMENT_DID_SAVE: _handle_save,
    lsp.TEXT_DOCUMENT_DID_CLOSE: _handle_close,
    lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES: _handle_watched_files,
    lsp.TEXT_DOCUMENT_HOVER: _handle_hover,
    lsp.TEXT_DOCUMENT_DEFINITION: _handle_definition,
    lsp.TEXT_DOCUMENT_REFERENCES: _handle_references,
    lsp.TEXT_DOCUMENT_COMPLETION: _handle_completion,
    lsp.TEXT_DOCUMENT_PREPARE_RENAME: _handle_prepare_rename,
    lsp.TEXT_DOCUMENT_RENAME: _handle_rename,
    lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL: _handle_document_symbols,
    lsp.WORKSPACE_SYMBOL: _handle_workspace_symbols,
    lsp.TEXT_DOCUMENT_CODE_LENS: _handle_code_lens,
    lsp.TEXT_DOCUMENT_FORMATTING: _handle_formatting,
}
_HANDLER_OPTIONS: Final[Mapping[str, Any]] = {
    lsp.TEXT_DOCUMENT_COMPLETION: lsp.CompletionOptions(trigger_characters=_TRIGGER_CHARACTERS),
    lsp.TEXT_DOCUMENT_RENAME: lsp.RenameOptions(prepare_provider=True),
    lsp.TEXT_DOCUMENT_CODE_LENS: lsp.CodeLensOptions(resolve_provider=False),
}
