"""``cxbridge format``: indents CLIPS files by their parentheses."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.console import say
from cxbridge.cli.entry import orderly
from cxbridge.errors import CxbridgeError
from cxbridge.file_access import write_file


@orderly()
def format(  # noqa: A001 - the name of the command
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="CLIPS files, or folders of them.")],
    check: Annotated[
        bool, typer.Option("--check", help="Change nothing; only name the files that would change.")
    ] = False,
) -> int:
    """Indent CLIPS files by their parentheses. White space changes, and nothing else.

    A file whose parentheses do not match is not changed.

    Exit status: 0 done, or nothing to do; 1 --check found files that would change; 2 a file cannot be read.

    Example: cxbridge format --check agent
    """
    from cxbridge_studio.agent.layout import is_balanced, layout

    changed = 0
    # Read all files before changing any, so that an unreadable file changes nothing.
    texts = {path: _read(path) for path in _clips_files(files)}
    for path, text in texts.items():
        if not is_balanced(text):
            say(f"{path}: parentheses or quotes do not match, left as it is", err=True)
            continue
        formatted = layout(text)
        if formatted != text:
            changed += 1
            say(f"{path}: {'would change' if check else 'changed'}")
            if not check:
                write_file(path, formatted.encode())
    return int(check and changed > 0)


def _clips_files(paths: list[Path]) -> list[Path]:
    clips_files: list[Path] = []
    for path in paths:
        if path.is_dir():
            clips_files += sorted(path.rglob("*.clp"))
        elif path.is_file():
            clips_files.append(path)
        else:
            raise CxbridgeError("there is no such file", file=path)
    return clips_files


def _read(path: Path) -> str:
    try:
        text = path.read_bytes().decode("utf-8")
    except OSError as error:
        raise CxbridgeError(f"cannot read it: {error.strerror}", file=path) from None
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:  # text in UTF-16 with ASCII letters only is also valid UTF-8
        raise CxbridgeError("it is not UTF-8 text", file=path, hint="save it as UTF-8 in the editor")
    return text
