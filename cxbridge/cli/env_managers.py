"""``cxbridge env``: what manages features, and the loggers of environments."""

from __future__ import annotations

from typing import Annotated

import typer

from cxbridge.cli.connect import DEFAULT_URL, AsJson, Connect
from cxbridge.cli.console import say, say_json
from cxbridge.cli.daemon_debug import ask_daemon

_Env = Annotated[str, typer.Argument(metavar="ENV", help="the environment, e.g. executive")]
_Features = Annotated[list[str], typer.Argument(metavar="FEATURE...", help="names of features")]
_Logger = Annotated[str, typer.Argument(metavar="LOGGER", help="its name")]


def list_features(url: Connect = DEFAULT_URL, as_json: AsJson = False) -> int:
    """List the features: whether environments may request them, and which have them."""
    found = ask_daemon(url, "feature-list")
    if as_json:
        say_json(found, indent=2)
        return 0
    width = max((len(info["name"]) for info in found), default=0)
    for info in found:
        state = "offered" if info["offered"] else "withdrawn"
        say(f"{info['name']:{width}}  {state:9}  {' '.join(info['environments'])}".rstrip())
    return 0


def offer(features: _Features, url: Connect = DEFAULT_URL) -> int:
    """Offer features to environments again that were withdrawn."""
    for name in features:
        ask_daemon(url, "feature-offer", feature=name)
    return 0


def withdraw(features: _Features, url: Connect = DEFAULT_URL) -> int:
    """Offer features no more: environments that request them get FALSE.

    Refused while an environment has one: 'cxbridge env feature ENV FEATURE --remove' first.
    """
    for name in features:
        ask_daemon(url, "feature-withdraw", feature=name)
    return 0


def list_loggers(env: _Env, url: Connect = DEFAULT_URL, as_json: AsJson = False) -> int:
    """List the loggers of an environment, in the order in which they get a line."""
    found = ask_daemon(url, "env-loggers", env=env)
    if as_json:
        say_json(found, indent=2)
        return 0
    for info in found:
        notes = [f"{info['level']} and above"]
        notes += [f"with '{info['contains']}'"] if info["contains"] else []
        notes += ["replaces"] if info["replaces"] else []
        say(f"{info['priority']:5}  {info['name']}  as {info['component']}: {', '.join(notes)}")
    return 0


def add_logger(
    env: _Env,
    logger: _Logger,
    priority: Annotated[
        int, typer.Option(metavar="N", help="who has more gets lines first; the first logger has 30")
    ] = 40,
    level: Annotated[str, typer.Option(metavar="LEVEL", help="lines of this level and above")] = "debug",
    contains: Annotated[str, typer.Option(metavar="TEXT", help="only lines with this in them")] = "",
    replace: Annotated[
        bool, typer.Option("--replace", help="what it takes does not come to those below")
    ] = False,
    component: Annotated[
        str, typer.Option("--as", metavar="COMPONENT", help="of the log; LOGGER|ENV by default")
    ] = "",
    url: Connect = DEFAULT_URL,
) -> int:
    """Give an environment another logger, above or below those that it has."""
    ask_daemon(
        url,
        "env-logger-add",
        env=env,
        logger=logger,
        priority=priority,
        level=level,
        contains=contains,
        replaces=replace,
        component=component,
    )
    return 0


def remove_logger(env: _Env, logger: _Logger, url: Connect = DEFAULT_URL) -> int:
    """Take a logger away from an environment."""
    ask_daemon(url, "env-logger-remove", env=env, logger=logger)
    return 0


def add_commands(app: typer.Typer) -> None:
    """Add these commands to those of ``cxbridge env``."""
    for name, command in (
        ("features", list_features),
        ("offer", offer),
        ("withdraw", withdraw),
        ("loggers", list_loggers),
        ("add-logger", add_logger),
        ("remove-logger", remove_logger),
    ):
        app.command(name)(command)
