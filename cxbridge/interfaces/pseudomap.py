"""Pseudo maps: access to single fields of an interface by number."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from typing import Any

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.block import Block
from cxbridge.interfaces.schema import PseudoMapSchema


class PseudoMap(MutableMapping[int, Any]):
    """A mapping from numbers to the fields of a block, which contains the values.

    :param block: the interface.
    :param schema: the fields of the keys.
    """

    def __init__(self, block: Block, schema: PseudoMapSchema) -> None:
        self._block = block
        self._schema = schema
        self._fields = {int(ref.key): ref.field for ref in schema.refs}

    def __getitem__(self, key: int) -> Any:
        return self._block.get(self._find_field_name(key))

    def __setitem__(self, key: int, value: Any) -> None:
        # the property marks the block as changed, `Block.set` does not
        self._block.ACCESSORS[self._find_field_name(key)].__set__(self._block, value)

    def __delitem__(self, key: int) -> None:
        raise InterfaceError(
            f"key {key} of pseudo map '{self._schema.name}' stands for a field and cannot be deleted"
        )

    def __iter__(self) -> Iterator[int]:
        return iter(self._fields)

    def __len__(self) -> int:
        return len(self._fields)

    def _find_field_name(self, key: int) -> str:
        field = self._fields.get(key)
        if field is None:
            keys = ", ".join(map(str, self._fields))
            raise InterfaceError(
                f"pseudo map '{self._schema.name}' has no key {key}", hint=f"it has the keys {keys}"
            )
        return field


def pseudomap_property(schema: PseudoMapSchema) -> property:
    """Return the read-only property for a pseudo map of a block."""
    return property(lambda block: PseudoMap(block, schema), doc=schema.comment or None)
