"""The program `cxbridge`: commands and handling of errors."""

from __future__ import annotations

import errno
import os
import re
import sys
import traceback
from collections.abc import Sequence

import typer

from cxbridge.cli.commands import HELP_SECTIONS
from cxbridge.cli.console import STDOUT, complain, guard_streams, name_stdout, say, say_text
from cxbridge.cli.discovery import make_group_class, top_level_rows
from cxbridge.errors import BrokenAgentError, CxbridgeError
from cxbridge.extras import missing_package_error
from cxbridge.plugins import installed_plugins, package_hint
from cxbridge.printing import indent_lines
from cxbridge.resources import VERSION

USAGE = 2
"""The exit status for bad input or usage, and for files that cannot be used."""

FAULT = 4
"""The exit status after a fault, such as a full disk or an internal error of cxbridge."""

INTERRUPTED = 130
"""The exit status after Ctrl-C."""

# Errors of a system without a free resource, or of a device (EIO), which are not mistakes of the user.
_EXHAUSTION_CODES = frozenset(
    {errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.ENOSPC, errno.EIO, errno.ENOBUFS, errno.EAGAIN}
    | ({errno.EDQUOT} if hasattr(errno, "EDQUOT") else set())
)

_UNKNOWN_COMMAND = re.compile(r"No such command '([\w-]+)'")
_CLOSED_STDOUT_CLASS = "PacifyFlushWrapper"  # the class of click's substitute for the stdout of a closed pipe

# Typer depends on click or contains a copy of click, depending on its version, which has the ClickException.
_ClickException: type[Exception] = next(
    base for base in typer.BadParameter.__mro__ if base.__name__ == "ClickException"
)

app = typer.Typer(
    name="cxbridge",
    cls=make_group_class(top_level_rows, HELP_SECTIONS),
    help="The CLIPS Executive with an emulated Fawkes blackboard, without Fawkes.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(is_given: bool) -> None:
    if is_given:
        say(f"cxbridge {VERSION}")
        for plugin in installed_plugins():
            say(f"{plugin.name}: {plugin.error or plugin.package}")
        raise typer.Exit


@app.callback()
def _options(
    _version: bool = typer.Option(
        False, "--version", callback=_print_version, is_eager=True, help="Show the version and exit."
    ),
) -> None:
    """Process the options before a command."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with the command's status.

    :param arguments: the arguments; by default ``sys.argv[1:]``.
    """
    name_stdout()
    guard_streams()
    try:
        status = invoke(arguments)
    except Exception as error:  # noqa: BLE001 - Python's exit status 1 has another meaning for the commands
        traceback.print_exc()
        say(f"cxbridge: an internal error of cxbridge: {type(error).__name__}: {error}", err=True)
        status = FAULT
    sys.exit(status)


def invoke(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status; mistakes of the user have no traceback."""
    try:
        status: object = _run_app(arguments)
    except BrokenAgentError as error:
        for mistake in error.mistakes:
            say_text(str(mistake), err=True)
        complain(error.message)
        status = error.exit_status
    except CxbridgeError as error:
        complain(error)
        status = FAULT if _is_due_to_exhaustion(error) else error.exit_status
    except _ClickException as error:
        # typer hides the class, so mypy does not know its members
        error.message = indent_lines(error.message) + _usage_hint(error)  # type: ignore[attr-defined]
        error.show()  # type: ignore[attr-defined]
        status = USAGE
    except (typer.Abort, KeyboardInterrupt):
        say("cxbridge: interrupted", err=True)
        status = INTERRUPTED
    except BrokenPipeError:
        # the reader of a pipe has closed it; without stderr, Python cannot report that its last flush of
        # stdout fails, too
        sys.stderr.close()
        status = 0
    except OSError as error:
        status = _report_system_error(error)
    except SystemExit as end:
        # click has caught the BrokenPipeError, replaced stdout and exited with status 1
        status = 0 if type(sys.stdout).__name__ == _CLOSED_STDOUT_CLASS else end.code
    return status if isinstance(status, int) else 0


def _usage_hint(error: Exception) -> str:
    """Return the line with a hint to the mistake in the arguments; empty if there is none.

    The hint names the package with the unknown option or command, or explains an argument too many.
    """
    name = getattr(error, "option_name", "")
    if not name and (unknown := _UNKNOWN_COMMAND.search(str(getattr(error, "message", "")))):
        name = unknown[1]
    hint = package_hint(name)
    if not hint and "unexpected extra argument" in str(error):
        hint = "one argument too many, or a value for an option that takes none"
    return f"\n  hint: {hint}" if hint else ""


def _run_app(arguments: Sequence[str] | None) -> object:
    """Run the command line; an error about a missing module names the package to install."""
    try:
        return app(arguments, standalone_mode=False, prog_name="cxbridge")
    except ModuleNotFoundError as error:
        raise missing_package_error(error) or error from None


def _report_system_error(error: OSError) -> int:
    """Print a system error with its file, or its place in the code; return the exit status."""
    if error.filename == STDOUT:
        complain(f"cannot write to stdout: {error.strerror or error}")
        # Python flushes stdout at exit, which would fail again
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return USAGE
    if error.filename is not None:
        complain(f"{error.filename}: {error.strerror}")
        return FAULT if _is_due_to_exhaustion(error) else USAGE
    frame = traceback.extract_tb(error.__traceback__)[-1]
    complain(
        f"the operating system reported an error: {error.strerror or error} "
        f"(in {frame.name}, {os.path.basename(frame.filename)}:{frame.lineno})"  # noqa: PTH119 - the name may be '<string>'
    )
    return FAULT


def _is_due_to_exhaustion(error: BaseException | None) -> bool:
    # the error of the system may be the cause of an error of cxbridge
    while error is not None:
        if getattr(error, "errno", None) in _EXHAUSTION_CODES:
            return True
        error = error.__cause__ or error.__context__
    return False
