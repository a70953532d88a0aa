"""``cxbridge env``: the CLIPS environments of a daemon."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cxbridge.cli.connect import DEFAULT_URL, AsJson, Connect
from cxbridge.cli.console import say, say_json, say_text
from cxbridge.cli.daemon_debug import ask_daemon
from cxbridge.cli.env_managers import add_commands
from cxbridge.errors import CxbridgeError
from cxbridge.printing import indented

app = typer.Typer(name="env", help="The CLIPS environments of a daemon.", no_args_is_help=True)
add_commands(app)

_Env = Annotated[str, typer.Argument(metavar="ENV", help="the environment, e.g. executive")]


@app.command("list")
def list_environments(url: Connect = DEFAULT_URL, as_json: AsJson = False) -> int:
    """List the environments."""
    found = ask_daemon(url, "env-list")
    if as_json:
        say_json(found, indent=2)
        return 0
    width = max(len(info["name"]) for info in found)
    for info in found:
        notes = [f"{info['facts']} facts", f"agenda {info['agenda']}", f"log {info['log_level']}"]
        notes += [f"watch {' '.join(info['watch'])}"] if info["watch"] else []
        notes += ["ended"] if info["ended"] else []
        features = f"  [{' '.join(info['features'])}]" if info["features"] else ""
        say(f"{info['name']:{width}}  {', '.join(notes)}{features}")
    return 0


@app.command()
def create(
    env: _Env,
    log_as: Annotated[
        str, typer.Option("--log", metavar="COMPONENT", help="under which it logs; 'CLIPS (ENV)' by default")
    ] = "",
    url: Connect = DEFAULT_URL,
) -> int:
    """Create an environment; its rules run in each loop, after the executive's."""
    ask_daemon(url, "env-create", env=env, log=log_as)
    return 0


@app.command()
def destroy(env: _Env, url: Connect = DEFAULT_URL) -> int:
    """Destroy an environment that was created so."""
    ask_daemon(url, "env-destroy", env=env)
    return 0


@app.command()
def load(
    env: _Env,
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="on the daemon's machine")],
    batch: Annotated[
        bool, typer.Option("--batch", help="execute commands: CLIPS' batch* instead of load*")
    ] = False,
    url: Connect = DEFAULT_URL,
) -> int:
    """Load files into an environment.

    Exit status: 0 done; 1 something in them is wrong; 2 a file cannot be read.
    """
    wrong: list[str] = []
    for file in files:
        wrong += ask_daemon(url, "env-load", env=env, file=str(file.absolute()), batch=batch)
    for text in wrong:
        say_text(indented(text), err=True)
    return 1 if wrong else 0


@app.command()
def feature(
    env: _Env,
    features: Annotated[list[str], typer.Argument(metavar="FEATURE...")],
    remove: Annotated[bool, typer.Option("--remove", help="take them away from it")] = False,
    url: Connect = DEFAULT_URL,
) -> int:
    """Give an environment features, as (ff-feature-request ...) does.

    Calls of functions of a feature that was taken away fail; it can be given again.
    """
    for name in features:
        ask_daemon(url, "env-feature-remove" if remove else "env-feature", env=env, feature=name)
    return 0


@app.command()
def watch(
    env: _Env,
    item: Annotated[str, typer.Argument(metavar="facts|rules|all")],
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME...]", show_default=False)] = None,
    off: Annotated[bool, typer.Option("--off", help="do not watch")] = False,
    url: Connect = DEFAULT_URL,
) -> int:
    """Watch facts or rules, all or those named: what is watched is recorded."""
    ask_daemon(url, "env-watch", env=env, item=item, names=names or [], on=not off)
    return 0


@app.command()
def log(
    env: _Env,
    level: Annotated[str, typer.Argument(metavar="debug|info|warn|error")],
    url: Connect = DEFAULT_URL,
) -> int:
    """Let an environment log only lines of this level and above."""
    ask_daemon(url, "env-log", env=env, level=level)
    return 0


@app.command()
def facts(
    env: _Env,
    template: Annotated[str, typer.Argument(metavar="[TEMPLATE]", show_default=False)] = "",
    url: Connect = DEFAULT_URL,
    as_json: AsJson = False,
) -> int:
    """List facts, at most 1000."""
    found = ask_daemon(url, "facts", env=env, template=template)
    if as_json:
        say_json([{"index": index, "text": text} for index, text in found], indent=2)
    else:
        for index, text in found:
            say(f"f-{index} {text}")
    return 0


@app.command()
def agenda(env: _Env, url: Connect = DEFAULT_URL, as_json: AsJson = False) -> int:
    """List what would fire, in order, at most 1000."""
    found = ask_daemon(url, "agenda", env=env)
    if as_json:
        rows = [{"salience": salience, "rule": rule, "facts": basis} for salience, rule, basis in found]
        say_json(rows, indent=2)
    else:
        for salience, rule, basis in found:
            say(f"{salience:6} {rule}: {basis}")
    return 0


@app.command("eval")
def evaluate(
    env: _Env,
    expression: Annotated[str, typer.Argument(metavar="EXPR", help="e.g. '(get-strategy)'")],
    url: Connect = DEFAULT_URL,
    as_json: AsJson = False,
) -> int:
    """Evaluate an expression of CLIPS; prints what it prints, and its value."""
    found = ask_daemon(url, "env-eval", env=env, expression=expression)
    if as_json:
        say_json(found, indent=2)
        return 0
    for line in (*found["output"], *filter(None, [found["text"]])):
        say(line)
    return 0


@app.command("assert")
def assert_fact(
    env: _Env, fact: Annotated[str, typer.Argument(metavar="(FACT)")], url: Connect = DEFAULT_URL
) -> int:
    """Assert a fact; prints its index."""
    say(f"f-{ask_daemon(url, 'assert', env=env, fact=fact)}")
    return 0


@app.command()
def retract(
    env: _Env, indices: Annotated[list[str], typer.Argument(metavar="INDEX...")], url: Connect = DEFAULT_URL
) -> int:
    """Retract facts."""
    for word in indices:
        ask_daemon(url, "retract", env=env, index=fact_index(word))
    return 0


@app.command()
def modify(
    env: _Env,
    index: Annotated[str, typer.Argument(metavar="INDEX")],
    slots: Annotated[list[str], typer.Argument(metavar="SLOT=VALUE...", help="VALUE as CLIPS writes it")],
    url: Connect = DEFAULT_URL,
) -> int:
    """Change slots of a fact; prints its new index."""
    given: dict[str, Any] = {}
    for word in slots:
        slot, equals, value = word.partition("=")
        if not slot or not equals:
            raise typer.BadParameter(f"'{word}' is not SLOT=VALUE", param_hint="SLOT=VALUE...")
        given[slot] = value
    say(f"f-{ask_daemon(url, 'modify', env=env, index=fact_index(index), slots=given)}")
    return 0


def fact_index(word: str) -> int:
    """Return a fact's index, written with or without ``f-``.

    :raises CxbridgeError: when it is no number.
    """
    digits = word.removeprefix("f-")
    if not digits.isdecimal():
        raise CxbridgeError(f"'{word}' is no fact", hint="use an index, e.g. f-12 or 12")
    return int(digits)
