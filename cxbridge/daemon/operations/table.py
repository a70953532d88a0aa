"""The table of all operations, of the modules in this folder and of plug-ins."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType, ModuleType
from typing import Any, Final

import cxbridge.daemon.operations
from cxbridge.daemon.operations.operation import Operation, OperationContext, to_json
from cxbridge.plugins import PluginError, Row, Table, is_module, make_module_rows
from cxbridge.rights import Right

OPERATION_MODULES: Final[Table[ModuleType]] = Table(
    "OPERATIONS", is_module, "a module with OPERATIONS", *make_module_rows(cxbridge.daemon.operations)
)
"""The modules of operations."""


def operations() -> Mapping[str, Operation[Any]]:
    """Return all operations by name.

    :raises PluginError: if two modules define an operation of the same name, or a module does not load.
    """
    return _load_operations(OPERATION_MODULES.rows)


# the rows are the key, because they follow sys.path, which may change within a process
@lru_cache(maxsize=4)
def _load_operations(rows: tuple[Row, ...]) -> Mapping[str, Operation[Any]]:
    operations_by_name: dict[str, Operation[Any]] = {}
    row_by_operation: dict[str, Row] = {}
    for row in rows:
        for operation in getattr(OPERATION_MODULES.load_target(row), "OPERATIONS", ()):
            if (first_row := row_by_operation.setdefault(operation.name, row)) is not row:
                raise PluginError(f"{first_row} and {row} both define the operation '{operation.name}'")
            operations_by_name[operation.name] = operation
    return MappingProxyType(operations_by_name)


def verbs() -> Mapping[str, Right]:
    """Return the verbs of RequestInterface with the required rights."""
    return {name: operation.right for name, operation in operations().items() if operation.is_verb}


def carry_out(context: OperationContext, name: str, **parameters: Any) -> Any:
    """Call an operation by name; return its result for JSON.

    :param name: the name of an operation in :func:`operations`.
    :raises CxbridgeError: if the parameters are invalid, or the operation fails.
    """
    operation = operations()[name]
    return to_json(operation.carry_out(context, operation.parse(parameters)))
