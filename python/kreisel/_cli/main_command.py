"""The command `kreisel`, which reports errors as a single line of text."""

from __future__ import annotations

import errno
import os
import re
import signal
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import click

from .._core import version
from .._results.path import Error
from . import compare_command, fit_command, lists, pages, solve_command, sweep_command

_CODES = """\b
Exit codes
  0    done
  1    a run failed, or a file could not be written; results so far are kept;
       or a package that the command needs is not installed
  2    invalid arguments; nothing was computed
  130  stopped by Ctrl-C or SIGTERM; results so far are kept"""


class _MainCommandGroup(click.Group):
    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: object,
    ) -> click.Context:
        with print_errors_on_one_line():
            return super().make_context(info_name, args, parent, **extra)

    def invoke(self, ctx: click.Context) -> None:
        with (
            print_errors_on_one_line(),
            convert_sigterm_to_interrupt(),
            _print_warnings_on_one_line(),
        ):
            super().invoke(ctx)


@contextmanager
def print_errors_on_one_line() -> Iterator[None]:
    """Return a context manager that prints an exception as a single line and sets the exit code."""
    try:
        yield
    except click.exceptions.NoArgsIsHelpError:
        raise
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "kreisel"
        code, message = 2, f"{error.format_message()} (see {command} --help)"
    except click.ClickException as error:
        code, message = error.exit_code, error.format_message()
    except Error as error:
        code, message = 1, str(error)
    except KeyboardInterrupt as error:
        code, message = 130, str(error) or "interrupted"
    except OSError as error:
        if error.errno == errno.EPIPE:
            raise
        code, message = 1, str(error)
    else:
        return
    drop_unwritable_stdout()
    message = re.sub(r"\[Errno \d+\] ", "", message)
    click.echo(f"Error: {message}", err=True)
    raise click.exceptions.Exit(code)


@contextmanager
def convert_sigterm_to_interrupt() -> Iterator[None]:
    """Return a context manager that treats SIGTERM like Ctrl-C, unless the signal is ignored."""
    if signal.getsignal(signal.SIGTERM) is signal.SIG_IGN:
        yield
        return
    try:
        handler = signal.signal(signal.SIGTERM, signal.default_int_handler)
    except ValueError:  # only the main thread can set signal handlers
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, handler)


@contextmanager
def _print_warnings_on_one_line() -> Iterator[None]:
    """Return a context manager that prints each warning as a single line on standard error."""
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_, **__: click.echo(f"Warning: {message}", err=True)
        yield


def drop_unwritable_stdout() -> None:
    """Redirect standard output to the null device if its buffer cannot be flushed.

    Without this redirection of standard output, the interpreter would report the same error again
    on exit. Does nothing if the process was started without a standard output.
    """
    if sys.stdout is None:
        return
    try:
        sys.stdout.flush()
    except OSError:
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@click.group(
    "kreisel",
    cls=_MainCommandGroup,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=_CODES,
)
@click.version_option(version, prog_name="kreisel")
def main() -> None:
    """Compute the motion of spinning tops.

    A SCENE is a TOML file, the name of a scene (see `kreisel scenes`), or - for TOML from standard
    input. Use - as the file name to write to standard output.
    """


for _command in (
    solve_command.solve,
    solve_command.resume,
    compare_command.compare,
    sweep_command.sweep,
    fit_command.fit,
    lists.methods,
    lists.scenes,
    lists.quantities,
    pages.view,
    pages.report,
):
    main.add_command(_command)
