"""Dependencies point downwards, and start-up stays cheap."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pkgutil import resolve_name

import pytest

from cxbridge import __version__
from tests.support import ROOT, imported_packages, module_files, statements

PACKAGE = ROOT / "cxbridge"
LAYERS = (  # lowest first; packages of one layer do not import each other
    {"closing", "errors", "interrupt", "numbers", "spawning", "suggestions"},
    {
        "resources",
        "clock",
        "printing",
        "rights",
        "listening",
        "lua_syntax",
        "config",
        "clipstext",
        "event_kinds",
        "extras",
        "file_access",
    },
    {"events", "mainloop", "plugins"},
    {"history", "interfaces"},
    {"blackboard"},
    {"space"},
    {"executive", "skiller", "trace"},
    {"run"},
    {"daemon"},
    {"testing"},
    {"cli", "pytest_plugin"},
    {"__main__"},
)

MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(PACKAGE.rglob("*.py"))
}


@cache
def imports(module: str) -> set[str]:
    """Return the modules of cxbridge that a module imports: for types or at run time, at any level."""
    names = set()
    for node in statements(ast.parse(MODULES[module].read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            names |= whole & MODULES.keys() or {node.module} & MODULES.keys()
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names} & MODULES.keys()
    return names - {module}


def package(module: str) -> str:
    return module.split(".")[1] if "." in module else ""


LAYER = {name: number for number, names in enumerate(LAYERS) for name in names}


def test_every_package_has_layer():
    assert {package(module) for module in MODULES} - {""} == LAYER.keys()


PAGE = (ROOT / "docs" / "architecture.md").read_text()


def test_page_shows_layers():
    rows = re.findall(r"^\| (\d+) \| (.*) \|$", PAGE, re.MULTILINE)
    assert [(int(number), set(re.findall(r"`(\w+)`", names))) for number, names in rows] == [
        (number, names) for number, names in reversed(list(enumerate(LAYERS)))
    ]


def exists(path: str) -> bool:
    """Whether a path of the page exists: below the package, a plug-in, or the top of the repository."""
    distribution = path.partition("/")[0].replace("_", "-")
    folders = (ROOT / "cxbridge", ROOT / "plugins" / distribution, ROOT)
    return any((folder / path).exists() for folder in folders)


def test_files_named_by_page_exist():
    table = PAGE.partition("## Where to add or change what")[2]
    paths = {path for path in re.findall(r"`([\w./-]+/[\w./-]*)`", table) if "NAME" not in path}
    assert len(paths) > 50
    assert {path for path in paths if not exists(path)} == set()


def test_dependencies_point_down():
    """One test: a thousand tests would take longer to report than to run."""
    upwards = {
        (module, name)
        for module in MODULES
        for name in imports(module)
        if package(module)
        and package(name) not in ("", package(module))
        and LAYER[package(name)] >= LAYER[package(module)]
    }
    assert upwards == set()


def test_imports_have_no_cycle():
    TopologicalSorter({module: imports(module) for module in MODULES}).prepare()  # names the cycle


def test_only_command_line_imports_typer():
    users = {
        package(module)
        for module, path in MODULES.items()
        if re.search(r"^\s*(import|from) (typer|click)\b", path.read_text(), re.MULTILINE)
    }
    assert users == {"cli"}


def test_command_line_imports_no_heavy_module():
    program = "import sys, cxbridge.cli.main; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    heavy = {
        "rich",
        "clips",
        "lupa",
        "lark",
        "mcap",
        "zmq",
        "yaml",
        "pyttsx3",
        "hypothesis",
        "starlette",
        "uvicorn",
    }
    assert heavy & set(done.stdout.split()) == set()


def test_only_one_module_compares_names():
    """Suggestions for misspelt names come from one module."""
    compare = [name for name, path in MODULES.items() if "get_close_matches" in path.read_text()]
    assert compare == ["cxbridge.suggestions"]


# -- the tests themselves

SLOW_ON_PURPOSE = {
    "trace/test_recorder.py",  # a slow writer
}


SLEEPS = re.compile(r"sleep|Event\(\)\.wait")
"""Words of a file that sleeps. Files without them need not be parsed."""


def sleeps(node: ast.AST, looping: bool = False) -> list[int]:
    """The lines of a file where a test sleeps outside a loop that checks a condition."""
    found = []
    if isinstance(node, ast.Call) and not looping:
        called = ast.unparse(node.func)
        if called in {"sleep", "time.sleep", "asyncio.sleep"} or (
            called.endswith("Event().wait") and node.args
        ):
            found.append(node.lineno)
    inside = (looping or isinstance(node, ast.For | ast.While)) and not isinstance(
        node, ast.FunctionDef | ast.Lambda
    )
    for child in ast.iter_child_nodes(node):
        found += sleeps(child, inside)
    return found


def test_tests_wait_for_conditions():
    """A test checks its condition until it holds: the duration depends on the machine."""
    tests = ROOT / "tests"
    hopeful = {
        str(path.relative_to(tests)): lines
        for path in sorted(tests.rglob("*.py"))
        if SLEEPS.search(text := path.read_text()) and (lines := sleeps(ast.parse(text)))
    }
    assert {name: lines for name, lines in hopeful.items() if name not in SLOW_ON_PURPOSE} == {}
    assert set(hopeful) == SLOW_ON_PURPOSE


# -- plug-ins

PLUGINS = {
    package.name: package
    for distribution in sorted((ROOT / "plugins").iterdir())
    for package in sorted(distribution.glob("cxbridge_*"))
}
"""The packages of the plug-ins of this repository, by name."""


def test_core_imports_no_plug_in():
    found = {module: imported_packages([path]) & PLUGINS.keys() for module, path in MODULES.items()}
    assert {module: names for module, names in found.items() if names} == {}


@pytest.mark.parametrize("name", PLUGINS)
def test_plug_in_imports_declared_plug_ins_only(name):
    project = tomllib.loads((PLUGINS[name].parent / "pyproject.toml").read_text())["project"]
    declared = {
        re.split(r"[=<>]", requirement)[0].replace("-", "_") for requirement in project["dependencies"]
    }
    imported = imported_packages(PLUGINS[name].rglob("*.py")) & PLUGINS.keys()
    assert imported - {name} - declared == set()
    assert f"cxbridge=={__version__}" in project["dependencies"]


def test_run_imports_requested_modules_only():
    # one of its goals waits idle for a timeout
    program = (
        "import sys; from cxbridge.cli.main import invoke; invoke(['run', 'test-scenario', '--quiet']); "
        "print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    modules = set(done.stdout.splitlines()[-1].split())
    parts = {name.partition(".")[2] for name in modules if name.partition(".")[0] in PLUGINS}
    assert parts <= {"", "plugin", "options", "fawkes_keys"}  # the tables of ROS 2 read keys of Fawkes
    assert "cxbridge.executive.features.pddl_parser" in modules
    assert not {"bson", "cxbridge.skiller.board", "google.protobuf", "pymongo", "zmq"} & modules


def test_modules_do_not_import_cxbridge_itself():
    """The package ``cxbridge`` imports all its parts: a module that imports the package depends on all."""
    assert {module for module in MODULES if "cxbridge" in imports(module) and module != "cxbridge"} == set()


NAMELESS = {"what", "who", "somebody", "someone", "something", "stuff"}
"""Words in place of a noun."""


def words_without_noun(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Yield arguments and variables whose name is no noun, with their lines; a field may be of a format."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(tree, ast.ClassDef) and isinstance(node, ast.AnnAssign):
            continue
        if isinstance(node, ast.arg) and node.arg in NAMELESS:
            yield node.arg, node.lineno
        elif isinstance(node, ast.Name) and node.id in NAMELESS:
            yield node.id, node.lineno
        yield from words_without_noun(node)


def test_arguments_and_variables_are_nouns():
    folders = (PACKAGE, *PLUGINS.values(), ROOT / "benchmarks")
    assert [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for folder in folders
        for path in sorted(folder.rglob("*.py"))
        for name, line in words_without_noun(ast.parse(path.read_text(encoding="utf-8")))
    ] == []


def test_class_with_getattr_reads_existing_attributes_only():
    """A type checker believes that such a class has any attribute."""
    for module, path in module_files().items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef) and "__getattr__" in {
                getattr(member, "name", "") for member in node.body
            }:
                own = [
                    attribute
                    for attribute in ast.walk(node)
                    if isinstance(attribute, ast.Attribute) and ast.unparse(attribute.value) == "self"
                ]
                found = resolve_name(f"{module.removesuffix('.__init__')}:{node.name}")
                known = {*dir(found), *found.__annotations__} | {
                    attribute.attr for attribute in own if isinstance(attribute.ctx, ast.Store)
                }
                assert {
                    attribute.attr for attribute in own if isinstance(attribute.ctx, ast.Load)
                } <= known, (
                    path,
                    node.name,
                )


@pytest.mark.parametrize(
    ("word", "table"), [("imply", "executive/pddl/ast.py"), ("double", "interfaces/fieldtypes.py")]
)
def test_lists_of_words_are_derived_from_one_table(word: str, table: str) -> None:
    """A second list of the words of formulas, or of the types of fields, would lack the next kind."""
    files = [file for file in module_files().values() if f'"{word}"' in file.read_text(encoding="utf-8")]
    assert files == [PACKAGE / table]


def raised_errors(tree: ast.AST) -> Iterator[str]:
    """Yield the classes of the errors that a function raises; functions inside it do not count."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            yield ast.unparse(node.exc.func).rpartition(".")[2]
        elif not isinstance(node, ast.FunctionDef | ast.Lambda):
            yield from raised_errors(node)


def test_docstring_with_raises_names_each_raised_error():
    """The docstring names the class of each error that the function itself raises, or a base class."""
    trees = [(path, ast.parse(path.read_text())) for path in module_files().values()]
    bases = {
        node.name: {ast.unparse(base) for base in node.bases}
        for _, tree in trees
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    }

    def with_bases(name: str) -> set[str]:
        return {name}.union(*map(with_bases, bases.get(name, ())))

    assert [
        f"{path.relative_to(ROOT)}:{function.lineno}: {name}"
        for path, tree in trees
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef) and ":raises" in (doc := ast.get_docstring(function) or "")
        for name in raised_errors(function)
        if name[0].isupper() and with_bases(name).isdisjoint(re.findall(r"\w+", doc))
    ] == []
