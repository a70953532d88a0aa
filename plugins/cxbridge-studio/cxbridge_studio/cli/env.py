"""``cxbridge env``: the CLIPS environments of a daemon, and their features."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from cxbridge.cli.connect import DEFAULT_URL, AsJson, Connect, ask_daemon
from cxbridge.cli.console import say, say_json, say_text
from cxbridge.printing import format_count, indent_lines
from cxbridge_studio.debugger.command_words import parse_number

app = typer.Typer(name="env", help="The CLIPS environments of a daemon.", no_args_is_help=True)

_Env = Annotated[str, typer.Argument(metavar="ENV", help="The environment, e.g. executive.")]


def _say_rows(
    rows: list[dict[str, Any]], format_line: Callable[[dict[str, Any]], str], *, as_json: bool
) -> None:
    """Print the rows of a listing as JSON or as lines.

    :param format_line: returns the line of a row.
    """
    if as_json:
        say_json(rows, indent=2)
        return
    for row in rows:
        say(format_line(row))


@app.command("features")
def list_features(url: Connect = DEFAULT_URL, as_json: AsJson = False) -> None:
    """List the features that environments may request, and the environments that have them.

    Example: cxbridge env features
    """
    features = ask_daemon(url, "feature-list")
    width = max((len(row["name"]) for row in features), default=0)

    def format_line(row: dict[str, Any]) -> str:
        return f"{row['name']:{width}}  {' '.join(row['environments'])}".rstrip()

    _say_rows(features, format_line, as_json=as_json)


@app.command("list")
def list_environments(url: Connect = DEFAULT_URL, as_json: AsJson = False) -> None:
    """List the environments.

    Example: cxbridge env list
    """
    environments = ask_daemon(url, "env-list")
    width = max(len(row["name"]) for row in environments)

    def format_line(row: dict[str, Any]) -> str:
        notes = [format_count(row["facts"], "fact"), f"agenda {row['agenda']}", f"log {row['log_level']}"]
        notes += [f"watch {' '.join(row['watch'])}"] if row["watch"] else []
        notes += ["ended"] if row["ended"] else []
        features = f"  [{' '.join(row['features'])}]" if row["features"] else ""
        return f"{row['name']:{width}}  {', '.join(notes)}{features}"

    _say_rows(environments, format_line, as_json=as_json)


@app.command()
def create(env: _Env, url: Connect = DEFAULT_URL) -> None:
    """Create an environment; its rules run in each loop, after the executive's.

    Example: cxbridge env create scratch
    """
    ask_daemon(url, "env-create", env=env)


@app.command()
def destroy(env: _Env, url: Connect = DEFAULT_URL) -> None:
    """Destroy an environment that 'cxbridge env create' has created.

    Example: cxbridge env destroy scratch
    """
    ask_daemon(url, "env-destroy", env=env)


@app.command()
def load(
    env: _Env,
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Files on the daemon's machine.")],
    batch: Annotated[
        bool, typer.Option("--batch", help="Execute commands, with CLIPS' batch* instead of load*.")
    ] = False,
    url: Connect = DEFAULT_URL,
) -> int:
    """Load files into an environment.

    Exit status: 0 done; 1 a file contains mistakes; 2 a file cannot be read.

    Example: cxbridge env load scratch rules.clp
    """
    mistakes: list[str] = []
    for file in files:
        mistakes += ask_daemon(url, "env-load", env=env, file=str(file.absolute()), batch=batch)
    for mistake in mistakes:
        say_text(indent_lines(mistake), err=True)
    return 1 if mistakes else 0


@app.command()
def feature(
    env: _Env,
    features: Annotated[list[str], typer.Argument(metavar="FEATURE...")],
    url: Connect = DEFAULT_URL,
) -> None:
    """Add features to an environment, as (ff-feature-request ...) does.

    Example: cxbridge env feature scratch blackboard
    """
    for name in features:
        ask_daemon(url, "env-feature", env=env, feature=name)


@app.command()
def watch(
    env: _Env,
    item: Annotated[str, typer.Argument(metavar="facts|rules|all")],
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME...]", show_default=False)] = None,
    off: Annotated[bool, typer.Option("--off", help="Stop watching.")] = False,
    url: Connect = DEFAULT_URL,
) -> None:
    """Watch all facts or rules, or those of the given names: watched facts and firings are recorded.

    Example: cxbridge env watch executive rules
    """
    ask_daemon(url, "env-watch", env=env, item=item, names=names or [], on=not off)


@app.command()
def log(
    env: _Env,
    level: Annotated[str, typer.Argument(metavar="debug|info|warn|error")],
    url: Connect = DEFAULT_URL,
) -> None:
    """Set the minimum level of the lines that an environment logs.

    Example: cxbridge env log executive warn
    """
    ask_daemon(url, "env-log", env=env, level=level)


@app.command()
def facts(
    env: _Env,
    template: Annotated[str, typer.Argument(metavar="[TEMPLATE]", show_default=False)] = "",
    url: Connect = DEFAULT_URL,
    as_json: AsJson = False,
) -> None:
    """List facts, at most 1000.

    Example: cxbridge env facts executive goal
    """
    rows = [
        {"index": index, "text": text} for index, text in ask_daemon(url, "facts", env=env, template=template)
    ]
    _say_rows(rows, lambda row: f"f-{row['index']} {row['text']}", as_json=as_json)


@app.command()
def agenda(env: _Env, url: Connect = DEFAULT_URL, as_json: AsJson = False) -> None:
    """List the activations of rules in the order of firing, at most 1000.

    Example: cxbridge env agenda executive
    """
    rows = [
        {"salience": salience, "rule": rule, "facts": basis}
        for salience, rule, basis in ask_daemon(url, "agenda", env=env)
    ]
    _say_rows(rows, lambda row: f"{row['salience']:6} {row['rule']}: {row['facts']}", as_json=as_json)


@app.command("eval")
def evaluate(
    env: _Env,
    expression: Annotated[
        str, typer.Argument(metavar="EXPR", help="A CLIPS expression, e.g. '(get-strategy)'.")
    ],
    url: Connect = DEFAULT_URL,
    as_json: AsJson = False,
) -> None:
    """Evaluate a CLIPS expression, and print its output and its value.

    Example: cxbridge env eval executive '(get-strategy)'
    """
    evaluation = ask_daemon(url, "env-eval", env=env, expression=expression)
    if as_json:
        say_json(evaluation, indent=2)
        return
    # the text is empty if the expression has no value
    for line in (*evaluation["output"], *filter(None, [evaluation["text"]])):
        say(line)


@app.command("assert")
def assert_fact(
    env: _Env, fact: Annotated[str, typer.Argument(metavar="(FACT)")], url: Connect = DEFAULT_URL
) -> None:
    """Assert a fact, and print its index.

    Example: cxbridge env assert executive '(hello world)'
    """
    say(f"f-{ask_daemon(url, 'assert', env=env, fact=fact)}")


@app.command()
def retract(
    env: _Env, indices: Annotated[list[str], typer.Argument(metavar="INDEX...")], url: Connect = DEFAULT_URL
) -> None:
    """Retract facts.

    Example: cxbridge env retract executive f-12
    """
    for index in indices:
        ask_daemon(url, "retract", env=env, index=parse_number(index))


@app.command()
def modify(
    env: _Env,
    index: Annotated[str, typer.Argument(metavar="INDEX")],
    slots: Annotated[
        list[str], typer.Argument(metavar="SLOT=VALUE...", help="Slots with VALUE in CLIPS' syntax.")
    ],
    url: Connect = DEFAULT_URL,
) -> None:
    """Change slots of a fact, and print its new index.

    Example: cxbridge env modify executive f-12 mode=FINISHED outcome=COMPLETED
    """
    changes: dict[str, Any] = {}
    for assignment in slots:
        slot, equals, value = assignment.partition("=")
        if not slot or not equals:
            raise typer.BadParameter(f"'{assignment}' is not SLOT=VALUE", param_hint="SLOT=VALUE...")
        changes[slot] = value
    say(f"f-{ask_daemon(url, 'modify', env=env, index=parse_number(index), slots=changes)}")
