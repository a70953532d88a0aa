"""Interface types: XML definitions, schemas, memory layouts and Python classes.

Every shipped type can be imported; its definition is read on first use::

    from cxbridge.interfaces import SkillerInterface
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cxbridge.interfaces.registry import InterfaceRegistry as InterfaceRegistry
    from cxbridge.interfaces.registry import default_registry as default_registry
    from cxbridge.interfaces.schema import InterfaceSchema as InterfaceSchema
    from cxbridge.interfaces.stubs import *  # noqa: F403 - made by 'cxbridge interface compile --stubs'

_MODULE_BY_NAME = {
    "InterfaceRegistry": "cxbridge.interfaces.registry",
    "default_registry": "cxbridge.interfaces.registry",
    "InterfaceSchema": "cxbridge.interfaces.schema",
}


def __getattr__(name: str) -> Any:
    """Return the class of a shipped interface type, or a public name, imported on first use."""
    from importlib import import_module  # noqa: PLC0415 - importing the package alone costs nothing

    if name in _MODULE_BY_NAME:
        return getattr(import_module(_MODULE_BY_NAME[name]), name)
    if name.endswith("Interface"):
        registry = import_module("cxbridge.interfaces.registry").default_registry()
        if registry.path(name) is not None:
            return registry.get(name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def __dir__() -> list[str]:
    from cxbridge.interfaces.registry import default_registry  # noqa: PLC0415 - as above

    return sorted({*globals(), *_MODULE_BY_NAME, *default_registry().names()})
