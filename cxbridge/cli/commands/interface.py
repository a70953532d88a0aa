"""``cxbridge interface``: interface definitions, listed, shown, checked and compiled."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cxbridge.cli.connect import AsJson
from cxbridge.cli.console import say, say_json, say_result, say_text
from cxbridge.file_access import write_file
from cxbridge.printing import indent_lines
from cxbridge.resources import shipped_interfaces

if TYPE_CHECKING:
    from cxbridge.interfaces.registry import InterfaceRegistry
    from cxbridge.interfaces.schema import InterfaceSchema

app = typer.Typer(name="interface", no_args_is_help=True)

BAD_DEFINITION = 2
"""The exit status for an invalid definition."""

DefinitionDirs = Annotated[
    list[Path] | None,
    typer.Option(
        "--interface-dir",
        metavar="DIR",
        help="Folder of definitions that take precedence over the shipped ones; may be given several times.",
    ),
]
TypeOrFile = Annotated[
    str,
    typer.Argument(
        metavar="NAME|FILE",
        help="An interface type, or a definition file.",
        autocompletion=shipped_interfaces,
    ),
]
TypesOrFiles = Annotated[
    list[str],
    typer.Argument(
        metavar="NAME|FILE...",
        help="Interface types, or definition files.",
        autocompletion=shipped_interfaces,
    ),
]


@app.callback()
def _interface() -> None:
    """Show and check interface definitions, and make Python modules from them."""


@app.command("list")
def list_types(interface_dir: DefinitionDirs = None, as_json: AsJson = False) -> None:
    """List all known interface types.

    Example: cxbridge interface list
    """
    names = make_checked_registry(interface_dir).names()
    say_result(names, names, as_json=as_json)


@app.command()
def show(type_or_file: TypeOrFile, interface_dir: DefinitionDirs = None, as_json: AsJson = False) -> None:
    """Show the layout of an interface: fields with offsets, messages, enums, constants, hash.

    Example: cxbridge interface show SkillerInterface
    """
    from cxbridge.interfaces.describe import describe_schema, describe_schema_for_json

    schema = _find_schema(type_or_file, interface_dir)
    say_result(describe_schema_for_json(schema), describe_schema(schema), as_json=as_json)


@app.command()
def check(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Definition files.")],
    as_json: AsJson = False,
) -> None:
    """Explain every mistake in definition files; exit status 0 without mistakes, 2 otherwise.

    Warnings are about definitions that Fawkes accepts but that are probably unintended; they do not change
    the status.

    Example: cxbridge interface check interfaces/HandInterface.xml
    """
    from cxbridge.interfaces.xml.parser import check_file

    findings: list[dict[str, Any]] = []
    for file in files:
        result = check_file(file)
        # by place; problems of the whole file, which have no line, come first
        problems = sorted(
            [*result.errors, *result.warnings], key=lambda problem: (problem.line or 0, problem.column or 0)
        )
        for problem in problems:
            severity = "error" if problem in result.errors else "warning"
            members = {name: getattr(problem, name) for name in ("file", "line", "column", "message", "hint")}
            findings.append({"severity": severity, **members})
            if not as_json:
                hint = f"\n  hint: {problem.hint}" if problem.hint else ""
                say_text(indent_lines(f"{problem.location}: {severity}: {problem.message}{hint}"))
        if not problems and not as_json:
            say(f"{file}: correct")
    if as_json:
        say_json(findings, indent=2)
    if any(finding["severity"] == "error" for finding in findings):
        raise typer.Exit(BAD_DEFINITION)


@app.command("hash")
def print_hash(
    names: TypesOrFiles,
    interface_dir: DefinitionDirs = None,
    wire: Annotated[
        bool,
        typer.Option(
            "--wire", help="Print the hash of Fawkes' own definition with the same layout, if it is known."
        ),
    ] = False,
) -> None:
    """Print the hashes of interfaces as Fawkes computes them: the MD5 of the definition file, in upper case.

    Example: cxbridge interface hash SkillerInterface --wire
    """
    from cxbridge.interfaces.known_hashes import hash_for_wire

    for name in names:
        schema = _find_schema(name, interface_dir)
        say(f"{(hash_for_wire(schema) if wire else schema.hash).hex().upper()}  {schema.name}")


@app.command("compile")
def compile_types(
    names: TypesOrFiles,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the modules.")],
    interface_dir: DefinitionDirs = None,
    stubs: Annotated[
        bool, typer.Option("--stubs", help="Write the stubs (.pyi) alone, without modules.")
    ] = False,
) -> None:
    """Write Python modules with the classes of interfaces, which need no XML, and stubs with their types.

    Example: cxbridge interface compile HandInterface -o hand --interface-dir interfaces
    """
    from cxbridge.interfaces.codegen import module_source, stub_source

    source_makers = {".pyi": stub_source} if stubs else {".py": module_source, ".pyi": stub_source}
    for schema in [_find_schema(name, interface_dir) for name in names]:
        for suffix, make_source in source_makers.items():
            path = output / f"{schema.name}{suffix}"
            write_file(path, make_source(schema))
            say(path)


def make_checked_registry(interface_dirs: list[Path] | None) -> InterfaceRegistry:
    """Return a registry of the given folders, which must exist, and of the shipped definitions.

    :raises InterfaceError: if a folder does not exist.
    """
    from cxbridge.errors import InterfaceError
    from cxbridge.interfaces.registry import InterfaceRegistry

    for folder in interface_dirs or ():
        if not folder.is_dir():
            raise InterfaceError(
                "there is no such folder of interfaces", file=folder, hint="check --interface-dir"
            )
    return InterfaceRegistry(interface_dirs or ())


def _find_schema(type_or_file: str, interface_dirs: list[Path] | None) -> InterfaceSchema:
    """Return the schema of a type, or of a definition file, which has a slash or ``.xml`` in its name."""
    from cxbridge.interfaces.xml.parser import parse_file

    if type_or_file.endswith(".xml") or "/" in type_or_file:
        return parse_file(type_or_file)
    return make_checked_registry(interface_dirs).schema(type_or_file)
