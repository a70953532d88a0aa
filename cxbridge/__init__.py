"""cxbridge: the CLIPS Executive with an emulated Fawkes blackboard, without Fawkes.

The main names are imported on first use::

    import cxbridge as cx
    print(cx.run("test-scenario"))

The classes of shipped interface types, such as ``cx.BatteryInterface``, are made on first use, too.
docs/api.md describes the names. Type checkers read ``__init__.pyi``.
"""

from typing import Any

# The modules of the public names.
_MODULE_BY_NAME = {
    "BlackBoard": "cxbridge.blackboard.base",
    "ClipsEnvironment": "cxbridge.executive.host.environment",
    "CxbridgeError": "cxbridge.errors",
    "Feature": "cxbridge.executive.feature",
    "Interface": "cxbridge.interfaces.instance",
    "Progress": "cxbridge.skiller.board.executor",
    "Run": "cxbridge.run.program.finished",
    "SkillExecutor": "cxbridge.skiller.board.executor",
    "SkillCall": "cxbridge.skiller.board.protocol",
    "SkillFailedError": "cxbridge.skiller.board.executor",
    "connect": "cxbridge.blackboard.connection",
    "open_run": "cxbridge.run.program.finished",
}


def __getattr__(name: str) -> Any:
    """Return a public object or the class of a shipped interface type; the first use imports its module."""
    from importlib import import_module  # noqa: PLC0415 - importing the package alone costs nothing

    if name == "__version__":
        return import_module("cxbridge.resources").VERSION
    if name == "run":  # a package, which is callable: cx.run("test-scenario")
        return import_module(f"{__name__}.{name}")
    if name == "Skill":  # the short name in agents, see docs/api.md
        name = "SkillExecutor"
    if name in _MODULE_BY_NAME:
        return getattr(import_module(_MODULE_BY_NAME[name]), name)
    if name.endswith("Interface"):
        return getattr(import_module("cxbridge.interfaces"), name)
    raise AttributeError(f"module 'cxbridge' has no attribute '{name}'")


def __dir__() -> list[str]:
    """Return the public names and all shipped interface types."""
    from cxbridge.interfaces import default_registry  # noqa: PLC0415 - as above

    return sorted({*globals(), *_MODULE_BY_NAME, "run", "Skill", *default_registry().names()})
