"""Docstrings for the reference, also of the native module, and references as links.

griffe reads the source. The stubs of ``tactid._native`` have types and no docstrings, which are
with the Rust code, as for results, and options and arrays are documented by their
declarations: all of it comes from the package.
"""

import inspect
import re
import textwrap
from typing import Any

import griffe

import tactid
from tactid import _native
from tactid._options.arrays import Caller, describe
from tactid._options.declaration import arguments
from tactid._options.options import OPTIONS, OWN
from tactid._results.records import SCHEMAS

ROLE = re.compile(r":\w+:`~?([\w.]+)`")
"""A reference in a docstring, such as ``:class:`tactid.Options```."""


ARRAYS_MARK = re.compile(r"^( *)<arrays>$", re.MULTILINE)
"""Where a docstring lists the arrays, which their declarations document."""

OWN_MARK = re.compile(r"^( *)<own>$", re.MULTILINE)
"""Where a docstring lists the options that only this function has."""

OWN_OF = {"design_excitation": OWN["design"], "calibrate": OWN["calibration"]}
"""The functions that have options of their own."""

EXAMPLE = re.compile(r"^>>> .*(?:\n.+)*", re.MULTILINE)
"""An example in a docstring, up to the next empty line."""


class ReferenceDocstrings(griffe.Extension):
    """Gives each object the docstring that ``help`` shows, with its references as links.

    Examples are shown as code.
    """

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Gives one object its docstring, and a class of the stubs its constructor."""
        if isinstance(obj, griffe.Class) and "__new__" in obj.members:
            obj.members["__init__"] = obj.members.pop("__new__")
        text = docstring(obj)
        if text is None:
            return
        text = ROLE.sub(lambda found: link(found.group(1), obj.path), text)
        text = EXAMPLE.sub(lambda found: f"```pycon\n{found.group()}\n```", text)
        if obj.docstring is None:
            obj.docstring = griffe.Docstring(text, parent=obj, parser="google")
        else:
            obj.docstring.value = text


def docstring(obj: griffe.Object) -> str | None:
    """Returns the docstring of an object; None where it has none."""
    if obj.path.startswith("tactid._native."):
        return runtime_docstring(obj.path.removeprefix("tactid._native."))
    if obj.path.startswith("tactid._results.records."):
        return record_docstring(*obj.path.split(".")[3:])
    if obj.docstring is None:
        return None
    # The reference has one list of the options, under `Options`.
    listed = attributes() if obj.path == "tactid._options.options.Options" else ""
    text = re.sub(r"\n *<options>", lambda _: listed, obj.docstring.value)
    caller: Caller = "online" if obj.name == "push" else "recording"
    text = ARRAYS_MARK.sub(lambda found: textwrap.indent(describe(caller), found[1]), text)
    own = arguments(OWN_OF.get(obj.name, {}))
    text = OWN_MARK.sub(lambda found: textwrap.indent(own, found[1]), text)
    return text.replace(", as follows", "")


def attributes() -> str:
    """Returns the options as the attributes of their class."""
    entries = (f"    {option.name}: {option.documentation}" for option in OPTIONS.values())
    return "\n".join(["\nAttributes:", *entries])


def runtime_docstring(path: str) -> str | None:
    """Returns the docstring of a class of the native module, or of one of its members."""
    thing: Any = _native
    for name in path.split("."):
        thing = getattr(thing, name, None)
    documented = callable(thing) or hasattr(thing, "__get__")
    return inspect.getdoc(thing) if documented else None


def record_docstring(name: str, attribute: str | None = None) -> str | None:
    """Returns the documentation of a structure of the crates, or of one of its fields."""
    schema = SCHEMAS.get(name, {})
    if attribute is not None:
        schema = schema.get("properties", {}).get(attribute, {})
    return schema.get("description")


def link(name: str, path: str) -> str:
    """Returns a link to a public name of tactid, or the name as code where there is none."""
    owner = path.split(".")[-1 if path.split(".")[-1] in tactid.__all__ else -2]
    parts = name.removeprefix("tactid.").split(".")
    if parts[0] not in tactid.__all__:
        owner_class = getattr(tactid, owner, None)
        if not hasattr(owner_class, parts[0]):
            return f"`{name}`"
        parts = [owner, *parts]
    return f"[`{name}`][tactid.{'.'.join(parts)}]"
