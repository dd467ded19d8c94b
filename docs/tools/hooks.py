"""What the build of the documentation adds to the pages in docs/.

MkDocs calls the functions named ``on_...``.
"""

import os
import re
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import latex2mathml.converter
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

from tactid import calibration_schema, combination_schema, result_schema
from tactid._cli.cli import COMMANDS

sys.path.insert(0, str(Path(__file__).parent))

from array_table import with_array_tables
from completeness import missing_names
from figures import FIGURES, draw
from schema_tables import combination_tables, finding_table, tables

EXTERNAL = re.compile(
    r"<(?:script|img|iframe|source)\b[^>]*\bsrc=[\"']?(?:https?:)?//[^\s>]+"
    r"|<link\b[^>]*\brel=[\"']?(?:stylesheet|preload|icon)[^>]*\bhref=[\"']?(?:https?:)?//[^\s>]+"
)
"""What a browser would load from elsewhere."""

SCHEMA_TABLES = {
    "<!-- schema -->": (tables, result_schema),
    "<!-- findings -->": (finding_table, result_schema),
    "<!-- paper schema -->": (tables, partial(result_schema, "nlms")),
    "<!-- combination schema -->": (combination_tables, combination_schema),
    "<!-- calibration schema -->": (tables, calibration_schema),
}
"""The tables of a JSON schema in the places of their marks."""


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Makes a fence ``math`` an equation in MathML, which needs neither a script nor a font."""
    fences = config.mdx_configs.setdefault("pymdownx.superfences", {})
    fences["custom_fences"] = [{"name": "math", "class": "equation", "format": _equation}]
    return config


def _equation(source: str, *_: Any, **__: Any) -> str:
    return f'<div class="equation">{latex2mathml.converter.convert(source, display="block")}</div>'


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Puts the tables of the JSON schema and of the arrays in the places of their marks."""
    for mark, (made, schema) in SCHEMA_TABLES.items():
        if mark in markdown:
            markdown = markdown.replace(mark, made(schema()))
    return with_array_tables(markdown)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the figures, and the reference of the command line."""
    for name in FIGURES:
        files.append(File.generated(config, f"figures/{name}.svg", content=draw(name)))
    page = File.generated(config, "reference/command-line.md", content=_command_line())
    files.append(page)
    return files


def _command_line() -> str:
    sections = ["# Command line", "This page is what `tactid COMMAND --help` prints."]
    for command in [None, *COMMANDS]:
        called = ["tactid", command] if command else ["tactid"]
        sections.append(f"## `{' '.join(called)}`")
        sections.append(f"```text\n{_help(called)}\n```")
    return "\n\n".join(sections) + "\n"


def _help(called: list[str]) -> str:
    program = str(Path(sys.executable).with_name(called[0]))
    environment = {**os.environ, "COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb"}
    done = subprocess.run(
        [program, *called[1:], "--help"],
        capture_output=True,
        text=True,
        env=environment,
        check=True,
    )
    return "\n".join(line.rstrip() for line in done.stdout.strip("\n").splitlines())


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """Refuses a page that would load anything from elsewhere."""
    found = EXTERNAL.search(output)
    if found is not None:
        raise PluginError(f"{page.file.src_uri} loads something from elsewhere: {found.group()}")
    return output


def on_post_build(config: MkDocsConfig) -> None:
    """Refuses a reference that lacks a public name."""
    missing = missing_names(Path(config.site_dir, "reference").glob("*.html"))
    if missing:
        raise PluginError(f"the reference lacks {', '.join(missing)}")
