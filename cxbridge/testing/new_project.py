"""Creation of projects from templates: an agent with a test, a CI workflow and a VS Code launch file."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Final

import yaml
from msgspec import Meta

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import write_file
from cxbridge.plugins import Row, Table
from cxbridge.resources import shipped_dir
from cxbridge.run.options import RunOptions
from cxbridge.run.source import source_of
from cxbridge.run.specs import choose_spec

_AGENT_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
# The template with the files that every project has.
_SHARED_TEMPLATE: Final = "shared"
# The tutorial's agent, whose name is replaced by that of the new agent.
_TUTORIAL_TEMPLATE: Final = "courier"
# The prefix of the field whose option selects a template, e.g. --from-fawkes.
_SOURCE_OPTION_PREFIX: Final = "from_"


class Template:
    """Base of templates; the fields of a subclass, a dataclass, are options.

    A template is used if its field ``from_NAME``, the option ``--from-NAME``, is given.
    """

    def files(self, name: str) -> Mapping[str, str]:
        """Return the texts of a project's files by path.

        :param name: the name of the project.
        :raises CxbridgeError: if the options name no source of a project.
        """
        raise NotImplementedError


TEMPLATES: Final[Table[type[Template]]] = Table(
    "TEMPLATES",
    lambda loaded: is_dataclass(loaded) and isinstance(loaded, type) and issubclass(loaded, Template),
    "a dataclass derived from cxbridge.testing.new_project.Template",
    Row("fawkes", f"{__name__}:FawkesTemplate"),
)
"""The templates that options select."""


@dataclass(frozen=True, kw_only=True)
class NewOptions:
    """The options of ``cxbridge new``, which are the options of all templates."""

    plugin_groups: tuple[Template, ...] = ()

    @classmethod
    def added_groups(cls) -> list[type[Template]]:
        """Return all templates, whose fields become options."""
        return [TEMPLATES.load_target(row) for row in TEMPLATES.rows]

    def find_selected_template(self) -> Template | None:
        """Return the selected template, None for the agent of the tutorial.

        :raises CxbridgeError: if options select two templates.
        """
        templates_by_option = {
            f"--{name.replace('_', '-')}": template
            for template in self.plugin_groups
            for name, value in vars(template).items()
            if name.startswith(_SOURCE_OPTION_PREFIX) and value is not None
        }
        if len(templates_by_option) > 1:
            raise CxbridgeError(f"{' and '.join(templates_by_option)} cannot be combined")
        return next(iter(templates_by_option.values()), None)


@dataclass(frozen=True, kw_only=True)
class FawkesTemplate(Template):
    """An agent that remains in its Fawkes checkout."""

    from_fawkes: Annotated[str | None, Meta(description="Begin from this spec of a Fawkes checkout.")] = None
    fawkes_dir: Annotated[Path | None, Meta(description="With --from-fawkes: the checkout.")] = None

    def files(self, name: str) -> Mapping[str, str]:
        """Return files that refer to the checkout.

        :raises CxbridgeError: if no checkout is named, or the checkout has no such agent.
        """
        if self.fawkes_dir is None:
            raise CxbridgeError("--from-fawkes needs a checkout", hint="name it with --fawkes-dir")
        checkout = self.fawkes_dir.absolute()
        replacements = checkout_replacements(
            name, checkout, RunOptions(fawkes_dir=checkout, spec=self.from_fawkes)
        )
        return read_template(shipped_dir("templates") / "fawkes", replacements)


def make_project(folder: Path, options: NewOptions) -> list[Path]:
    """Make a project.

    :param folder: the new folder, whose name becomes the name of the agent.
    :returns: the written files.
    :raises CxbridgeError: if the name or the options are invalid, a file exists, or a file cannot be written.
    """
    name = _check_agent_name(folder)
    template = options.find_selected_template()
    templates_folder = shipped_dir("templates")
    if template is None:
        files: Mapping[str, str] = read_template(
            templates_folder / _TUTORIAL_TEMPLATE, {_TUTORIAL_TEMPLATE: name}
        )
    else:
        files = template.files(name)
    return _write_new_files(
        {
            folder / path: text
            for path, text in {**files, **read_template(templates_folder / _SHARED_TEMPLATE)}.items()
        }
    )


def checkout_replacements(name: str, checkout: Path, options: RunOptions) -> dict[str, str]:
    """Return the placeholders of a template, with their texts for an agent that remains in its checkout.

    :param name: the name of the project.
    :raises CxbridgeError: if the checkout has no such agent.
    """
    options.check()
    config, _ = source_of(options).load_configuration()
    spec = choose_spec(config, options.spec)
    return {
        "@NAME@": name,
        "@DIR@": str(checkout),
        "@DIR_TEXT@": json.dumps(str(checkout)),
        "@DIR_SHELL@": shlex.quote(str(checkout)),
        "@SPEC@": spec,
        "@SPEC_TEXT@": json.dumps(spec),
    }


def read_template(folder: Path, replacements: Mapping[str, str] = MappingProxyType({})) -> dict[str, str]:
    """Return the texts of a template's files by path, with placeholders replaced.

    In paths, ``dot-`` becomes a dot, and the suffix ``.in``, which hides files from tools, is removed. Names
    of tests become valid module names.

    :param replacements: the texts by placeholder.
    """
    return {
        _make_target_path(file.relative_to(folder), replacements): _replace_placeholders(
            file.read_text("utf-8"), replacements
        )
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }


def _check_agent_name(folder: Path) -> str:
    """Return the name of a project's agent.

    :raises CxbridgeError: if the name is not usable in files and identifiers.
    """
    name = folder.absolute().name
    if _AGENT_NAME.fullmatch(name) is None:
        raise CxbridgeError(
            f"'{name}' cannot be the name of an agent",
            hint="begin with a letter of a to z, then letters, digits, - and _",
        )
    if yaml.safe_load(name) != name:  # e.g. no, or null
        raise CxbridgeError(f"'{name}' cannot be the name of an agent: YAML does not read it as a string")
    return name


def _write_new_files(files: Mapping[Path, str]) -> list[Path]:
    """Write all files and return their paths.

    :raises CxbridgeError: if a file exists, before any file is written, or if a file cannot be written.
    """
    for file in files:
        if file.exists() or file.is_symlink():
            raise CxbridgeError(
                "this file exists already", file=file, hint="nothing was written: choose another name"
            )
    for file, text in files.items():
        write_file(file, text)
    return list(files)


def _make_target_path(path: Path, replacements: Mapping[str, str]) -> str:
    names = []
    for name in path.parts:
        if name.startswith("test_"):  # a Python module, whose name cannot have a dash
            replacements = {placeholder: text.replace("-", "_") for placeholder, text in replacements.items()}
        names.append(re.sub("^dot-", ".", _replace_placeholders(name, replacements)).removesuffix(".in"))
    return "/".join(names)


def _replace_placeholders(text: str, replacements: Mapping[str, str]) -> str:
    return (
        re.sub("|".join(map(re.escape, replacements)), lambda match: replacements[match.group()], text)
        if replacements
        else text
    )
