"""``cxbridge format``: indents CLIPS files by their parentheses."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cxbridge.cli.console import say
from cxbridge.cli.entry import handle_signals
from cxbridge.errors import CxbridgeError
from cxbridge.file_access import write_file


@handle_signals()
def format(  # noqa: A001 - the name of the command
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="CLIPS files, or folders of them.")],
    check: Annotated[bool, typer.Option("--check", help="Only list the files that would change.")] = False,
) -> int:
    """Indent CLIPS files by their parentheses. Only white space changes.

    A file with parentheses that do not match stays unchanged.

    Exit status: 0 done; 1 --check has found files that would change; 2 a file cannot be read.

    Example: cxbridge format --check agent
    """
    from cxbridge_studio.agent.layout import indent_clips
    from cxbridge_studio.agent.top_level import is_balanced

    changed_count = 0
    # read all files before the first change, so that after an unreadable file nothing has changed
    clips_files = (
        clips_file
        for path in files
        for clips_file in (sorted(path.rglob("*.clp")) if path.is_dir() else [path])
    )
    texts = {path: _read_text(path) for path in clips_files}
    for path, text in texts.items():
        if not is_balanced(text):
            say(f"{path}: parentheses or quotes do not match; the file stays unchanged", err=True)
            continue
        formatted_text = indent_clips(text)
        if formatted_text != text:
            changed_count += 1
            say(f"{path}: {'would change' if check else 'changed'}")
            if not check:
                write_file(path, formatted_text.encode())
    return int(check and changed_count > 0)


def _read_text(path: Path) -> str:
    """Return the text of a file.

    :raises CxbridgeError: if the file is not UTF-8 text.
    :raises OSError: if the file cannot be read.
    """
    try:
        text = path.read_bytes().decode("utf-8")
    except UnicodeDecodeError:
        text = "\0"  # refused below, as UTF-16
    if "\0" in text:  # UTF-16, too: ASCII letters in UTF-16 are valid UTF-8 with a NUL next to each letter
        raise CxbridgeError("it is not UTF-8 text", file=path, hint="save it as UTF-8 in the editor")
    return text
