"""Groups of options: dataclasses that a command takes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest
import typer
from msgspec import Meta
from typer.testing import CliRunner

from cxbridge.cli.option_groups import OVERRIDES, option_groups
from cxbridge.daemon.options import DaemonOptions
from cxbridge.daemon.services.options import ExecutorOptions, RecordOptions, ReplayOptions
from cxbridge.run.options import RunOptions
from cxbridge.testing.new_project import FawkesTemplate


@dataclass(frozen=True, kw_only=True)
class Where:
    where: Annotated[Path | None, typer.Argument()] = None
    colour: Annotated[str, Meta(description="Which.")] = "red"


@dataclass(frozen=True, kw_only=True)
class How:
    layers: Annotated[tuple[int, ...], typer.Option("--layer", min=1)] = ()
    coats: Annotated[int, Meta(ge=1, le=3)] = 1
    fast: Annotated[bool, Meta(description="At once.")] = False


@dataclass(frozen=True, kw_only=True)
class Painting(Where, How):
    colour: Annotated[str, Meta(description="Of the paint.")] = "blue"
    names: Annotated[Path | tuple[Path, ...] | None, Meta(description="Whose.")] = None
    dry: bool = False  # no option


seen: list[object] = []
app = typer.Typer(rich_markup_mode=None)


@app.command()
@option_groups
def paint(
    given: Painting,
    rooms: Annotated[int, typer.Option(min=1)],
    brush: Annotated[str, typer.Option()] = "broad",
) -> int:
    """Paint rooms."""
    seen[:] = [given, rooms, brush]
    return 0


def test_fields_are_options():
    done = CliRunner().invoke(
        app, ["here", "--layer", "1", "--layer", "2", "--rooms", "3", "--name", "a", "--name", "b"]
    )
    assert done.exit_code == 0, done.output
    painting = Painting(where=Path("here"), layers=(1, 2), names=(Path("a"), Path("b")))
    assert seen == [painting, 3, "broad"]


def test_options_have_order_of_groups():
    help_text = CliRunner().invoke(app, ["--help"]).output
    names = ["--colour", "--layer", "--coats", "--fast", "--name", "--rooms", "--brush"]
    places = [help_text.index(name) for name in names]
    assert places == sorted(places)
    assert "Of the paint." in help_text
    assert "--dry" not in help_text
    assert "--no-fast" not in help_text
    assert "[default: blue]" in help_text


@pytest.mark.parametrize(
    "wrong",
    [
        ["--layer", "0", "--rooms", "1"],
        ["--coats", "4", "--rooms", "1"],
        ["--no-fast", "--rooms", "1"],
        [],
        ["--dry", "--rooms", "1"],
    ],
)
def test_usage_is_checked(wrong):
    assert CliRunner().invoke(app, wrong).exit_code == 2


def test_declared_options_are_fields():
    groups = (RunOptions, DaemonOptions, RecordOptions, ReplayOptions, ExecutorOptions, FawkesTemplate)
    bases = {base for group in groups for base in group.__mro__}
    fields = {f"{base.__name__}.{name}" for base in bases for name in vars(base).get("__annotations__", ())}
    assert OVERRIDES.keys() - fields == set()
