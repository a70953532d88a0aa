"""The protocol's kinds for the kinds of names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from lsprotocol import types as lsp

from cxbridge_studio.agent.names import NameKind

SYMBOL_KINDS: Final[Mapping[NameKind, lsp.SymbolKind]] = {
    NameKind.RULE: lsp.SymbolKind.Event,
    NameKind.TEMPLATE: lsp.SymbolKind.Struct,
    NameKind.SLOT: lsp.SymbolKind.Field,
    NameKind.FUNCTION: lsp.SymbolKind.Function,
    NameKind.GLOBAL: lsp.SymbolKind.Variable,
    NameKind.FACTS: lsp.SymbolKind.Object,
    NameKind.MODULE: lsp.SymbolKind.Module,
    NameKind.CLASS: lsp.SymbolKind.Class,
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
    NameKind.PROTO_MESSAGE: lsp.SymbolKind.Struct,
    NameKind.PROTO_FIELD: lsp.SymbolKind.Field,
    NameKind.FILE: lsp.SymbolKind.File,
}
COMPLETION_KINDS: Final[Mapping[NameKind, lsp.CompletionItemKind]] = {
    NameKind.TEMPLATE: lsp.CompletionItemKind.Struct,
    NameKind.SLOT: lsp.CompletionItemKind.Field,
    NameKind.FIELD: lsp.CompletionItemKind.Field,
    NameKind.FUNCTION: lsp.CompletionItemKind.Function,
    NameKind.GLOBAL: lsp.CompletionItemKind.Variable,
    NameKind.ACTION: lsp.CompletionItemKind.Method,
    NameKind.SKILL: lsp.CompletionItemKind.Function,
    NameKind.INTERFACE: lsp.CompletionItemKind.Interface,
    NameKind.PROTO_MESSAGE: lsp.CompletionItemKind.Struct,
    NameKind.PROTO_FIELD: lsp.CompletionItemKind.Field,
    NameKind.FILE: lsp.CompletionItemKind.File,
}
