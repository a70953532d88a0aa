"""Makes a project of templates: an agent with a test, a workflow for CI and a launch file for VS Code."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import yaml

from cxbridge.errors import CxbridgeError
from cxbridge.resources import shipped_dir
from cxbridge.run.options import RunOptions
from cxbridge.run.program.plain_options import make_options
from cxbridge.run.source import source_of
from cxbridge.run.specs import choose_spec

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_SHARED: Final = "shared"
"""The template of the files that all projects have."""
_TUTORIAL: Final = "courier"
"""The tutorial's agent, whose name stands for that of the new one."""


def new_agent(folder: Path) -> list[Path]:
    """Make the agent of the tutorial.

    :param folder: of the project; its name is the agent's.
    :returns: the files that were made.
    :raises CxbridgeError: when the name is invalid, a file exists, or a file cannot be written.
    """
    name = _name_of(folder)
    return _make(_TUTORIAL, folder, {_TUTORIAL: name})


def new_agent_of_fawkes(folder: Path, checkout: Path, spec: str) -> list[Path]:
    """Make a project for an agent in a Fawkes checkout, which stays there.

    :raises CxbridgeError: likewise, and when the checkout has no such spec.
    """
    checkout = checkout.absolute()
    return _make_around("fawkes", folder, checkout, RunOptions(fawkes_dir=checkout, spec=spec))


def new_agent_of_ros2cx(folder: Path, checkout: Path) -> list[Path]:
    """Make a project for the agent in a checkout of ros2-clips-executive (2021), which stays there.

    :raises CxbridgeError: likewise.
    """
    checkout = checkout.absolute()
    return _make_around("ros2cx", folder, checkout, make_options(None, ros2cx=checkout))


def _make_around(template: str, folder: Path, checkout: Path, options: RunOptions) -> list[Path]:
    """Make a project for an agent that is elsewhere."""
    name = _name_of(folder)
    options.check()
    config, _ = source_of(options).load_configuration()
    spec = choose_spec(config, options.spec)
    words = {
        "@NAME@": name,
        "@DIR@": str(checkout),
        "@DIR_TEXT@": json.dumps(str(checkout)),
        "@DIR_SHELL@": shlex.quote(str(checkout)),
        "@SPEC@": spec,
        "@SPEC_TEXT@": json.dumps(spec),
    }
    return _make(template, folder, words)


def _name_of(folder: Path) -> str:
    """Return the name of the agent of a project.

    :raises CxbridgeError: when files and rules cannot be named so.
    """
    name = folder.absolute().name
    if _NAME.fullmatch(name) is None:
        raise CxbridgeError(f"'{name}' cannot name an agent", hint="use letters, digits, - and _")
    if yaml.safe_load(name) != name:
        raise CxbridgeError(f"'{name}' cannot name an agent: YAML takes it for a value, not a text")
    return name


def _make(template: str, folder: Path, words: Mapping[str, str]) -> list[Path]:
    """Write the files of a template with its words replaced; nothing when one of them exists.

    :returns: the files, as seen from where ``folder`` is.
    """
    files = {
        folder / _renamed(file.relative_to(source), words): _worded(file.read_text("utf-8"), words)
        for source in (shipped_dir("templates") / name for name in (template, _SHARED))
        for file in sorted(source.rglob("*"))
        if file.is_file()
    }
    there = next((file for file in files if file.exists() or file.is_symlink()), None)
    if there is not None:
        raise CxbridgeError(
            "this file exists already", file=there, hint="nothing was written: choose another name"
        )
    for file, text in files.items():
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            with file.open("x", encoding="utf-8", newline="\n") as stream:
                stream.write(text)
        except OSError as error:
            raise CxbridgeError(f"cannot be written: {error.strerror}", file=file) from error
    return list(files)


def _renamed(path: Path, words: Mapping[str, str]) -> Path:
    """Return the path of a file of a template.

    Tests have names that Python can import. ``dot-`` stands for a dot; ``.in`` keeps tools off.
    """
    parts = []
    for part in path.parts:
        is_test = part.startswith("test_")
        named = _worded(
            part, {old: new.replace("-", "_") for old, new in words.items()} if is_test else words
        )
        parts.append(re.sub("^dot-", ".", named).removesuffix(".in"))
    return Path(*parts)


def _worded(text: str, words: Mapping[str, str]) -> str:
    """Return a text with other words, all exchanged at once."""
    return re.sub("|".join(map(re.escape, words)), lambda match: words[match.group()], text)
