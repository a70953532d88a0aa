"""The table of all operations: those of each module beside this one that has ``OPERATIONS``."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from types import MappingProxyType, ModuleType
from typing import Any

import cxbridge.operations
from cxbridge.operations.operation import Operation, OperationContext, plain
from cxbridge.rights import Right


def submodules(package: ModuleType) -> Iterator[ModuleType]:
    """Import the modules of a package, and yield them by name."""
    for info in pkgutil.iter_modules(package.__path__):
        yield import_module(f"{package.__name__}.{info.name}")


@cache
def operations() -> Mapping[str, Operation[Any]]:
    """Return all operations by name."""
    found: dict[str, Operation[Any]] = {}
    for module in submodules(cxbridge.operations):
        for operation in getattr(module, "OPERATIONS", ()):
            if operation.name in found:
                raise ValueError(f"two operations are called '{operation.name}'")
            found[operation.name] = operation
    return MappingProxyType(found)


def verbs() -> Mapping[str, Right]:
    """Return the verbs of RequestInterface, and the right that each needs."""
    return {name: each.right for name, each in operations().items() if each.is_verb}


def carry_out(context: OperationContext, name: str, **given: Any) -> Any:
    """Carry out an operation of this name; returns what JSON can have.

    :param given: its parameters.
    :raises CxbridgeError: when they make no sense, or it cannot be done.
    """
    operation = operations()[name]
    return plain(operation.carry_out(context, operation.parse(given)))
