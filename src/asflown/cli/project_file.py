"""The project file `asflown.toml`: craft, channel dictionary, store and options that a folder's work has in common.

It is looked for in the working folder and upward.  What it says takes the place of an option that is not given; paths in it
count from its own folder.  Where a verb uses anything of it, it stands among the inputs of the provenance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict

from ..kit.config import toml_table, validated
from ..kit.errors import BadInput, some_of
from ..kit.reading import read_bytes
from ..kit.result import inputs_of
from .project import Defaults

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_REMEDY = "Its keys: craft, channels, store, and [defaults] (docs/cli.md)."

#: Verbs whose --craft says another thing: which of a store's crafts, or one in place of the scenario's.
_OTHER_CRAFT = frozenset(
    {("simulate",), ("report",), ("trend", "list"), ("trend", "show"), ("trend", "compare"), ("trend", "watch")}
)


#: Parameters that name a file or folder: relative to the project file's folder.
_PATHS = frozenset({"store", "exclude", "figures", "plot", "plot_dir", "out", "report", "folder", "channels"})


class Project(BaseModel):
    """What a project file says."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    craft: str | None = None
    channels: str | None = None
    store: str | None = None
    defaults: dict[str, Any] = {}


def defaults_from(path: Path, program) -> dict:
    """Defaults of every verb of ``program`` (a command group) as nested dictionaries.

    Raises BadInput for a file that is not a project's, and for a verb or option that is not known."""
    project = validated(Project, toml_table(read_bytes(path, "project file", ""), path), path, _REMEDY)
    source = inputs_of(path)
    verbs = {words: (command, Defaults(source)) for words, command in _verbs(program)}
    _spread(project, path.parent, verbs)
    _spread_options(project.defaults, path, verbs)
    tree: dict = {}
    for words, (_, values) in verbs.items():
        at = tree
        for word in words[:-1]:
            at = at.setdefault(word, {})
        at[words[-1]] = values
    return tree


def _verbs(group, words=()) -> Iterator[tuple[tuple[str, ...], Any]]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _verbs(command, (*words, name))
        else:
            yield (*words, name), command


def _spread(project: Project, folder: Path, verbs: dict) -> None:
    """Craft, dictionary and store, for the verbs that take them."""
    craft, channels, store = project.craft, project.channels, project.store
    if craft is not None and (craft.endswith(".toml") or "/" in craft):
        craft = str(folder / craft)
    if channels is not None:
        channels = str(folder / channels)
    if store is not None and "://" not in store:
        store = str(folder / store)
    for words, (command, values) in verbs.items():
        names = {p.name for p in command.params}
        if craft is not None and "craft" in names and words not in _OTHER_CRAFT:
            values["craft"] = craft
        if channels is not None and "channels" in names:
            values["channels"] = channels
        # to keep a result on request stays a request: only verbs that work on a store take the project's
        if store is not None and "store" in names and words[0] in ("trend", "report"):
            values["store"] = store


def _spread_options(defaults: dict, path: Path, verbs: dict) -> None:
    """[defaults]: an option for every verb that has it, or a table for one verb; a verb's own wins."""
    for name, value in defaults.items():
        if not isinstance(value, dict):
            _set(name, value, path, list(verbs.values()), "no verb has")
    for name, table in defaults.items():
        if isinstance(table, dict):
            _spread_verb((name,), table, path, verbs)


def _spread_verb(words: tuple[str, ...], table: dict, path: Path, verbs: dict) -> None:
    verb = words if words in verbs else (*words, "fit")
    known = any(w[: len(words)] == words for w in verbs)
    if not known:
        raise BadInput(
            f"[defaults.{'.'.join(words)}] names no verb",
            file=path,
            remedy=f"Verbs: {some_of(dict.fromkeys(w[0] for w in verbs))}.",
        )
    for name, value in table.items():
        if isinstance(value, dict):
            _spread_verb((*words, name), value, path, verbs)
        else:
            _set(name, value, path, [verbs[verb]] if verb in verbs else [], f"asflown {' '.join(words)} does not have")


def _set(name: str, value, path: Path, verbs: list, who: str) -> None:
    """One option of some verbs.  Raises BadInput where none of them has it."""
    taken = False
    for command, values in verbs:
        for p in command.params:
            if f"--{name}" in p.opts:
                is_path = p.name in _PATHS and isinstance(value, str) and "://" not in value
                values[p.name] = str(path.parent / value) if is_path else value
                taken = True
    if not taken:
        raise BadInput(
            f"[defaults] sets {name!r}, an option that {who}",
            file=path,
            remedy='Write options as on the command line, without the dashes: plot-dir = "figures".',
        )
