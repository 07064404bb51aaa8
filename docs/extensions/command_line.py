"""The directive ``command-line``: every command with its options, from the program itself."""

import re
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from typer.main import get_command

from vergence.app.main import app as program


class CommandLine(SphinxDirective):
    """Write a section for each command."""

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        return self.parse_text_to_nodes("\n".join(reference()), allow_section_headings=True)


def reference() -> Iterator[str]:
    """Yield the lines of the reference, in Markdown."""
    yield from _group(get_command(program), "vergence")


def _group(group: Any, name: str) -> Iterator[str]:
    for command in group.commands.values():
        full = f"{name} {command.name}"
        if hasattr(command, "commands"):
            yield from _group(command, full)
        else:
            yield from _command(command, full)


def _command(command: Any, name: str) -> Iterator[str]:
    yield from (f"## {name}", "", *_meaning(command.help or "").split("\n"), "")
    arguments = [p for p in command.params if not p.opts[0].startswith("-")]
    options = [p for p in command.params if p not in arguments]
    usage = "".join(f" {_word(p)}" if p.required else f" [{_word(p)}]" for p in arguments)
    yield from ("```text", f"{name}{usage} [OPTIONS]", "```", "")
    if command.epilog:
        word, _, example = command.epilog.partition(": ")
        examples = "` or `".join(re.split(" +or +", example))
        yield from (f"{word}: `{examples}`", "")
    yield from ("| | meaning | default |", "|---|---|---|")
    for parameter in (*arguments, *options):
        cells = (_name(parameter), _meaning(parameter.help or ""), _default(parameter))
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
    yield ""


def _name(parameter: Any) -> str:
    if not parameter.opts[0].startswith("-"):
        return f"`{_word(parameter)}`"
    names = "`, `".join([*parameter.opts, *parameter.secondary_opts])
    value = "" if parameter.is_flag else f" {parameter.metavar or _kind(parameter)}"
    return f"`{names}{value}`"


def _word(argument: Any) -> str:
    return argument.metavar or argument.name.upper()


def _meaning(text: str) -> str:
    """Return a help text with its options as code: elsewhere two hyphens become a dash."""
    return re.sub(r"(?<![\w`-])--[a-z][a-z-]*", r"`\g<0>`", text)


def _kind(parameter: Any) -> str:
    annotation = parameter.type_descriptor.annotation
    return str(getattr(annotation, "__name__", annotation)).upper()


def _default(parameter: Any) -> str:
    if parameter.required:
        return "required"
    if parameter.default is False or parameter.default in (None, ""):
        return ""
    if parameter.default is True and parameter.secondary_opts:
        return f"`{parameter.opts[0]}`"
    return f"`{parameter.default}`"


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive("command-line", CommandLine)
    return {"parallel_read_safe": True}
