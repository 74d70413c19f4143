"""Reference pages that are made from the code: ``python -m tests.docs.reference`` writes them all.

They are kept under version control, so that they can be read without running anything; a test
compares them with the code.
"""

from __future__ import annotations

import enum
import inspect
import re
import tempfile
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Any

from typer.main import get_command

from dearig.cli.main import app
from dearig.config import sequence_example
from dearig.config.rigfile import write_default
from dearig.formulas import as_text
from dearig.model.effects import EFFECTS, FAMILIES, ORIGINS, Effect
from dearig.model.effects.registry import OURS
from dearig.report.text.diagnosis import family_label
from dearig.report.text.laws import other_symbols, parameter_meanings, place_text

FOLDER = Path(__file__).parents[2] / "app" / "docs" / "reference"

_COMMANDS = """\
# Commands

Made from the code by `python -m tests.docs.reference`.

`RIG` is `sim` (a simulated rig that is the thesis's model), `sim:SEED` (one that hides an effect),
`sim:SEED:second` (one whose effects have other forms), `sim:SEED:pink` (one with another noise),
`daqmx:Dev1` (the card in this computer) or `daqmx:Dev1@HOST:PORT` (a card behind NI's gRPC device
server). `SEQUENCE` is a file or the name of a preset.

Outputs are checked before the work. What exists is replaced with `--force` only. Bad input is
answered with one sentence. An unexpected error names the log file that has its details.
`dearig --version` prints the version, `dearig --install-completion` lets the shell complete
commands and options, and `-v` shows more messages. Exit codes and the documents of `--json` are on
the page [JSON](json.md).
"""
_EFFECTS = """\
# Effects and their laws

Made from the code by `python -m tests.docs.reference`; `dearig effects` lists the same, and
`dearig effects "dry friction"` prints one. These are the effects that the
[diagnosis](../explanation/diagnosis.md) knows. Values are in SI units. An effect vanishes where
its amplitudes, the first parameters, are neutral. [Add an
effect](../../../model/effects/README.md) says how one more is added.
"""
_RIG_FILE = """\
# Rig file

Made from the code by `python -m tests.docs.reference`; `dearig rig-file my-rig.toml` writes the
same. A rig file needs only the keys that differ from these defaults, which are the thesis's rig.
[Set up a rig PC](../how-to/rig-pc.md) says what to look at first.

"""


def commands() -> str:
    """The page of all commands: usage, arguments and options of each."""
    group: Any = get_command(app)
    return "\n".join(
        [_COMMANDS, *(_command(name, group.commands[name]) for name in group.commands)]
    )


def rig_file() -> str:
    """The page of the rig file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rig.toml"
        write_default(path)
        return f"{_RIG_FILE}```toml\n{path.read_text(encoding='utf-8').rstrip()}\n```\n"


def effects() -> str:
    """The page of the effects: equations, symbols, parameters and source of each."""
    ours = [e for e in EFFECTS.values() if ORIGINS[e.name] == OURS]
    parts = [_EFFECTS]
    for family in FAMILIES:
        members = sorted((e for e in ours if e.family == family), key=lambda e: e.name.lower())
        parts += [f"## Family: {family_label(family)}\n"] if members else []
        parts += [_effect(e) for e in members]
    return "\n".join(parts)


def _effect(effect: Effect) -> str:
    assert effect.law is not None
    about = (
        f"{effect.summary[:1].upper()}{effect.summary[1:]}. It acts {place_text(effect.acts_on)}."
    )
    lines = [f"### {effect.name[:1].upper()}{effect.name[1:]}", about]
    lines += [f"```math\n{equation}\n```" for equation in effect.law.equations]
    rows = ["| symbol | parameter | meaning | unit | from | to |", "|---|---|---|---|---|---|"]
    rows += [
        f"| `{as_text(symbol)}` | `{p.name}` | {_escaped(name)} {_escaped(meaning)} | {unit} "
        f"| {p.bounds[0]:g} | {p.bounds[1]:g} |"
        for (symbol, name, meaning, unit), p in zip(
            parameter_meanings(effect), effect.parameters, strict=True
        )
    ]
    lines.append("\n".join(rows))
    others = "; ".join(f"`{as_text(s)}` {meaning}" for s, meaning in other_symbols(effect))
    lines += [f"{others}."] if others else []
    lines.append(f"Source: {effect.law.source}.")
    return "\n\n".join(lines) + "\n"


PAGES: dict[str, Callable[[], str]] = {
    "commands.md": commands,
    "effects.md": effects,
    "rig-file.md": rig_file,
    "sequences.md": sequence_example.page,
}


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for name, page in PAGES.items():
        (FOLDER / name).write_text(page(), encoding="utf-8", newline="\n")
        print(FOLDER / name)


def _command(name: str, command: Any) -> str:
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option" and not p.hidden]
    kinds = typing.get_type_hints(inspect.unwrap(command.callback))
    usage = " ".join(["dearig", name, *(_argument(p) for p in arguments)])
    parts = [f"## {name}", _sentence(command.help), f"```text\n{usage} [OPTIONS]\n```"]
    rows = [f"| `{p.metavar or p.name.upper()}` | {_cell(p)} |" for p in arguments]
    rows += [f"| {_names(p, kinds)} | {_cell(p)} |" for p in options if "--help" not in p.opts]
    if rows:
        parts.append("\n".join(["| argument or option | meaning |", "|---|---|", *rows]))
    return "\n\n".join(parts) + "\n"


def _argument(parameter: Any) -> str:
    name = parameter.metavar or parameter.name.upper()
    return name if parameter.required else f"[{name}]"


def _names(option: Any, kinds: dict[str, Any]) -> str:
    names = ", ".join(f"`{name}`" for name in [*option.opts, *option.secondary_opts])
    if option.is_flag or option.count:
        return names
    return f"{names} {_escaped(option.metavar or _kind(kinds[option.name]))}"


def _kind(annotation: Any) -> str:
    """What a value may be: its choices, or the kind of number or text."""
    if typing.get_origin(annotation) is typing.Literal:
        return "|".join(typing.get_args(annotation))
    for part in typing.get_args(annotation):
        if part is not type(None):
            return _kind(part)
    if issubclass(annotation, enum.Enum):
        return "|".join(str(choice.value) for choice in annotation)
    return {int: "INTEGER", float: "NUMBER", Path: "PATH"}.get(annotation, "TEXT")


def _cell(parameter: Any) -> str:
    notes = []
    default = getattr(parameter.default, "value", parameter.default)
    if parameter.required:
        notes.append("required")
    elif isinstance(parameter.show_default, str):
        notes.append(f"default: {parameter.show_default}")
    elif isinstance(default, Path):
        notes.append(f"default: `{default.as_posix()}`")
    elif isinstance(default, str | int | float) and not isinstance(default, bool):
        notes.append(f"default: `{default}`" if default != "" else "")
    elif default is True:
        notes.append(f"default: `{parameter.opts[0]}`")
    text = _escaped(_sentence(parameter.help or ""))
    return " ".join([text, *(f"({note})" for note in notes if note)])


def _sentence(text: str) -> str:
    return re.sub(r"\s+", " ", text).strip()


def _escaped(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    main()
