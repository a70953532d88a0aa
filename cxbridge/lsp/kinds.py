"""What the protocol calls the sorts of names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from lsprotocol import types as lsp

from cxbridge.agent.names import Kind

SYMBOL_KINDS: Final[Mapping[Kind, lsp.SymbolKind]] = {
    Kind.RULE: lsp.SymbolKind.Event,
    Kind.TEMPLATE: lsp.SymbolKind.Struct,
    Kind.SLOT: lsp.SymbolKind.Field,
    Kind.FUNCTION: lsp.SymbolKind.Function,
    Kind.GLOBAL: lsp.SymbolKind.Variable,
    Kind.FACTS: lsp.SymbolKind.Object,
    Kind.CLASS: lsp.SymbolKind.Class,
    Kind.ACTION: lsp.SymbolKind.Method,
    Kind.PARAMETER: lsp.SymbolKind.TypeParameter,
    Kind.PREDICATE: lsp.SymbolKind.Property,
    Kind.OBJECT_TYPE: lsp.SymbolKind.Class,
    Kind.CONSTANT: lsp.SymbolKind.Constant,
    Kind.SKILL: lsp.SymbolKind.Function,
    Kind.ARGUMENT: lsp.SymbolKind.TypeParameter,
    Kind.INTERFACE: lsp.SymbolKind.Interface,
    Kind.FIELD: lsp.SymbolKind.Field,
    Kind.MESSAGE: lsp.SymbolKind.Method,
    Kind.PROTO_MESSAGE: lsp.SymbolKind.Struct,
    Kind.PROTO_FIELD: lsp.SymbolKind.Field,
    Kind.FILE: lsp.SymbolKind.File,
}
COMPLETION_KINDS: Final[Mapping[Kind, lsp.CompletionItemKind]] = {
    Kind.TEMPLATE: lsp.CompletionItemKind.Struct,
    Kind.SLOT: lsp.CompletionItemKind.Field,
    Kind.FIELD: lsp.CompletionItemKind.Field,
    Kind.FUNCTION: lsp.CompletionItemKind.Function,
    Kind.GLOBAL: lsp.CompletionItemKind.Variable,
    Kind.ACTION: lsp.CompletionItemKind.Method,
    Kind.SKILL: lsp.CompletionItemKind.Function,
    Kind.INTERFACE: lsp.CompletionItemKind.Interface,
    Kind.PROTO_MESSAGE: lsp.CompletionItemKind.Struct,
    Kind.PROTO_FIELD: lsp.CompletionItemKind.Field,
    Kind.FILE: lsp.CompletionItemKind.File,
}
