"""Options on the command line: numbers separated by commas or spaces, and each option once."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from typer.core import TyperOption

from tactid._base.errors import ArgumentError
from tactid._cli.command import Command


class NumberListCommand(Command):
    """A command whose options of several numbers take them by commas, spaces or both.

    Such an option has a placeholder with commas: ``X,Y,Z`` for three numbers, ``G,G,...`` for one
    and more.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Reads the arguments, those of each list joined to one."""
        counts = {
            flag: None if "..." in option.metavar else option.metavar.count(",") + 1
            for option in self.params
            if isinstance(option, TyperOption) and option.metavar and "," in option.metavar
            for flag in option.opts
        }
        whole = list(joined(args, counts))
        check_given_once(self.make_parser(ctx).parse_args(args=list(whole))[2])
        return super().parse_args(ctx, whole)


def check_given_once(given: Sequence[Any]) -> None:
    """Checks that an option of one value is given once: of several, only the last would count.

    Args:
        given: The arguments and options of a command line, each as often as it is given.
    """
    for option in given:
        is_single = isinstance(option, TyperOption) and not (option.multiple or option.is_flag)
        if is_single and given.count(option) > 1:
            flag, count = option.opts[0], given.count(option)
            raise ArgumentError(f"{flag} is given {count} times, but once is possible only")


def joined(arguments: Sequence[str], counts: Mapping[str, int | None]) -> Iterator[str]:
    """Joins the numbers that follow each flag by commas.

    Args:
        arguments: The arguments of a command.
        counts: For each flag, the number of its numbers; None for any.
    """
    left = list(arguments)
    while left:
        flag, equals, first = left.pop(0).partition("=")
        if flag == "--":
            yield flag
            yield from left
            return
        if flag not in counts:
            yield flag + equals + first
            continue
        yield flag
        found = _numbers(first) if equals else []
        if equals and not found:
            yield first
            continue
        count = counts[flag]
        while left and (count is None or len(found) < count) and _numbers(left[0]):
            found += _numbers(left.pop(0))
        if found:
            yield ",".join(found)


def _numbers(text: str) -> list[str]:
    """Returns the numbers of a text; none where anything else is in it."""
    words = text.replace(",", " ").split()
    try:
        for word in words:
            float(word)
    except ValueError:
        return []
    return words
