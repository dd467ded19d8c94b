"""Progress and notes of the commands, on standard error."""

import json
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from tactid._base import terminal
from tactid._base.errors import ArgumentError, LogError
from tactid._base.naming import abridged, listed
from tactid._base.output_files import (
    FigureFormat,
    check_outputs,
    check_report,
    replaced_outputs,
)
from tactid._base.text_table import whole_width
from tactid._cli.command import interruptible


class Stream(Console):
    """A standard stream. The program decides what follows when its reader goes away."""

    def on_broken_pipe(self) -> None:
        """Raises ``BrokenPipeError``, where Rich would exit with code 1."""
        raise BrokenPipeError

    def render_str(self, text: str, **style: Any) -> Text:
        """Returns a text with escapes in place of its control characters."""
        return super().render_str(terminal.printable(text), **style)


FIGURES = "Writes the figures of the report beside it, too, in this format."
"""Help of the option for figures."""


def check_files(
    outputs: Mapping[str, Path | None], inputs: Mapping[str, Path | None]
) -> list[Path]:
    """Checks the outputs of a command, and returns the files of an earlier run that they replace.

    Raises:
        ArgumentError: An output cannot be written, or would replace what tactid has not written.
    """
    check_outputs(outputs, inputs)
    return replaced_outputs(outputs)


def print_written(sentence: str, replaced: Sequence[Path]) -> None:
    """Prints what was written, after the files of an earlier run that were replaced."""
    if replaced:
        names = abridged([str(path) for path in replaced], 6)
        notes.print(f"Files of an earlier run were replaced: {names}.", markup=False)
    if sentence:
        notes.print(sentence, markup=False)


def check_figures(report: Path | None, figures: FigureFormat | None) -> None:
    """Checks the options of a command for its report and the figures of it.

    Raises:
        ArgumentError: The report is no page, or figures are asked for without one.
    """
    if report is not None:
        check_report("--report", report, figures)
    elif figures is not None:
        raise ArgumentError("--figures writes the figures of a report: give --report")


notes = Stream(stderr=True, highlight=False, soft_wrap=True)


def print_whole(table: Table) -> None:
    """Prints a table on standard output without truncating cells, in a narrow terminal too."""
    console = Stream()
    console.width = max(console.width, whole_width(table, console))
    console.print(table, soft_wrap=True)


def print_json(text: str) -> None:
    """Prints a JSON document; where standard output is not UTF-8, with escapes for the rest."""
    if not terminal.is_utf8(sys.stdout):
        text = re.sub(r"[^\x00-\x7f]", lambda found: json.dumps(found[0])[1:-1], text)
    sys.stdout.write(text)


@contextmanager
def reporting_partial_log(log: Path) -> Iterator[None]:
    """Says what a log holds where its run ends early, by Ctrl-C, SIGTERM or a full disk."""
    holds = f"{log} holds the run up to here"
    with interruptible(holds):
        try:
            yield
        except LogError as error:
            # Other errors come before the first message, and a device holds nothing.
            if error.message.startswith(f"cannot write {log}:") and log.is_file():
                error.message += f"; {holds}"
            raise


Writers: TypeAlias = Mapping[Path, Callable[[Path], list[Path] | None]]
"""What writes each of some files, and returns what it wrote beside it."""


@contextmanager
def printing_before(writers: Writers, replaced: Sequence[Path]) -> Iterator[None]:
    """Prints a result in its block, then writes files, also where nobody reads the result.

    Ctrl-C in the block says that the files are not written.

    Args:
        writers: What writes the files.
        replaced: Those that :func:`check_files` has returned.
    """
    names = [str(path) for path in writers]
    try:
        with interruptible(f"did not write {listed(names)}" if names else None):
            yield
    except typer.Exit:
        raise
    except BaseException:
        write_files(writers)
        raise
    wrote = _sentence(write_files(writers))
    with interruptible(_clause(wrote)):
        print_written(wrote, replaced)


@contextmanager
def printing_after(writers: Writers, replaced: Sequence[Path]) -> Iterator[None]:
    """Writes files, then prints a result in its block, and then the names of the files.

    Ctrl-C in the block says which files are written.

    Args:
        writers: What writes the files.
        replaced: Those that :func:`check_files` has returned.
    """
    wrote = _sentence(write_files(writers))
    with interruptible(_clause(wrote)):
        yield
        print_written(wrote, replaced)


def _sentence(written: Sequence[Path]) -> str:
    return f"Wrote {', '.join(map(str, written))}." if written else ""


def _clause(sentence: str) -> str | None:
    return sentence[:1].lower() + sentence[1:].removesuffix(".") if sentence else None


def write_files(writers: Writers) -> list[Path]:
    """Writes files one after the other; Ctrl-C says which of them are written.

    Returns:
        The files that are written, those beside others included.
    """
    names = [str(path) for path in writers]
    written: list[Path] = []
    for done, (path, write) in enumerate(writers.items()):
        outcome = [f"wrote {listed([str(each) for each in written])}"] if written else []
        with interruptible("; ".join([*outcome, f"did not write {listed(names[done:])}"])):
            written += [path, *(write(path) or [])]
    return written


@contextmanager
def progress(label: str, count: int | None = None) -> Iterator[Callable[[float], None]]:
    """Shows a progress bar with the remaining time if standard error is a terminal.

    The block calls what it gets with the fraction done, or with the number of ``count`` things.
    """
    if not notes.is_terminal:
        yield lambda _: None
        return
    # Takes a while to load, and no script needs it.
    from rich import progress as bars

    columns = (
        bars.TextColumn("{task.description:<12}"),
        bars.BarColumn(bar_width=None),
        bars.TaskProgressColumn() if count is None else bars.MofNCompleteColumn(),
        bars.TimeRemainingColumn(elapsed_when_finished=True),
    )
    with bars.Progress(*columns, console=notes) as bar:
        task = bar.add_task(label, total=1.0 if count is None else count)
        yield lambda done: bar.update(task, completed=done)
