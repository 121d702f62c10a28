"""The one way a verb runs: places checked, craft and telemetry in, an estimate, then store, files, figures, JSON or text.

    job = Job(context)
    result = torque(job.telemetry(), job.craft(), method=method)
    job.finish(result)

Options are read from the verb's own parameters by name (``craft``, ``inertia``, ``cm``, ``channels``, ``exclude``, ``start``,
``stop``, ``out``, ``folder``, ``plot``, ``plot_dir``, ``store``, ``name``, ``json``), so that a verb states only what is its own.
"""

from __future__ import annotations

import os
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from .options import craft_from
from .output import print_doubts, print_json, say
from .progress import shown
from .project import Defaults
from .verb import WRITTEN, Asked, weighed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from ..craft.model import Craft
    from ..kit.doubts import Doubts
    from ..kit.result import Estimate, Input
    from ..telemetry.telemetry import Telemetry
    from ..trends.entry import Entry

#: Parameters that say how to answer, not what was asked: they are no part of the provenance's options.
_NOT_OPTIONS = frozenset(
    {
        "file",
        "files",
        "plan",
        "json",
        "plot",
        "plot_dir",
        "out",
        "table",
        "report",
        "folder",
        "store",
        "name",
        "channels",
        "exclude",
        "strict",
        "accept",
        "force",
    }
)


class Job:
    """One run of a verb.  Raises BadInput at once where a file that is asked for cannot be written."""

    def __init__(self, context: typer.Context):
        self.given: dict[str, Any] = dict(context.params)
        self.verb = context.command_path.partition(" ")[2].removesuffix(" fit")
        self._check_places()

    # ---- what goes in ----

    @cached_property
    def craft(self) -> Craft:
        """The craft that --craft or the project file names, with --inertia and --cm."""
        return self.craft_named(self.given["craft"])

    def craft_named(self, name: str | None) -> Craft:
        """A craft with --inertia and --cm in place of its own.  Raises BadInput where none is named."""
        return craft_from(name, self.given.get("inertia"), self.given.get("cm"))

    def telemetry(self, file: Path | None = None) -> Telemetry:
        """Telemetry through the door, cut to the window; of the verb's ``file`` unless another is named."""
        from ..telemetry.load import load_telemetry

        with shown():
            whole = load_telemetry(
                file or self.given["file"],
                channels=self.given.get("channels"),
                exclude=self.given.get("exclude"),
                craft=self.craft,
            )
        return whole.between(self.given.get("start"), self.given.get("stop"))

    @property
    def options(self) -> dict:
        """What was asked, for the provenance."""
        from ..kit.plain import plain

        return {n: plain(v) for n, v in self.given.items() if n not in _NOT_OPTIONS} | Asked.options()

    # ---- what comes out ----

    def finish(
        self,
        result: Estimate,
        *,
        inputs: Iterable[Input] = (),
        options: dict | None = None,
        more: dict | None = None,
        entry: Callable[[Estimate, str | None], Entry | list[Entry]] | None = None,
        figures: Callable[[Any], dict] | None = None,
        text: Callable[[], None] | None = None,
        failed: bool = False,
    ) -> None:
        """Keep, write, draw and tell a result, in this order.

        ``inputs``: files beside telemetry, dictionary, exclusions and craft; ``options``: settled values in place of those
        given, such as the method chosen; ``more``: further keys of the JSON; ``entry``: makes the store's entry, or entries, of the result
        and the name given; ``figures``: all figures by name, for --plot-dir; ``text``: prints more after the table;
        ``failed``: a check failed, which ends the program with exit code 3."""
        result = replace(
            result,
            doubts=weighed(result.doubts),
            inputs=tuple(dict.fromkeys((*result.inputs, *inputs, *Defaults.used))),
            options=self.options | (options or {}),
        )
        if self.given.get("store") is not None and entry is not None:
            self._keep(entry(result, self.given.get("name")))
        self._write(result, figures)

        def table() -> None:
            print(result)
            if text is not None:
                text()

        self._tell(result.record() | (more or {}), result.provenance, result.doubts, table)
        if failed:
            raise typer.Exit(3)

    def tell(
        self,
        record: dict,
        doubts: Doubts,
        text: Callable[[], None],
        *,
        last: Callable[[], None] = lambda: None,
        inputs=(),
        options=None,
        seed=None,
    ) -> None:
        """The end of a verb whose result is no estimate: its ``record`` with doubts and provenance as JSON, or its text.

        ``last``: prints what comes after the doubts."""
        from ..kit.result import provenance

        doubts = weighed(doubts)
        told = provenance((*inputs, *Defaults.used), self.options | (options or {}), seed)
        self._tell(record | doubts.record(), told, doubts, text, last)

    def _tell(
        self,
        record: dict,
        provenance: dict,
        doubts: Doubts,
        text: Callable[[], None],
        last: Callable[[], None] = lambda: None,
    ) -> None:
        if self.given.get("json"):
            print_json({"command": self.verb} | record | {"provenance": provenance})
        else:
            text()
            print_doubts(doubts)
            last()

    def _write(self, result: Estimate, figures) -> None:
        """The files asked for: all of them, or none."""
        out, plot, plot_dir = (self.given.get(n) for n in ("out", "plot", "plot_dir"))
        if out is plot is plot_dir is None:
            return
        from ..kit.files import together

        wrote, read = [], [i.file for i in result.inputs]
        with together():
            if out is not None:
                self.may_write(out, result.file_kind, read)
                result.save(out)
                wrote.append(out)
            if plot is not None:
                from ..plots import save_figure

                self.may_write(plot, "picture", read)
                save_figure(result, plot)
                wrote.append(plot)
            if plot_dir is not None and figures is not None:
                from ..plots.figure import save_figures

                drawn = figures(result)
                for name in drawn:
                    self.may_write(plot_dir / f"{name}.svg", "picture", read)
                wrote += save_figures(drawn, plot_dir)
        for path in wrote:
            say(f"wrote {path}")

    def _keep(self, entries: Entry | list[Entry]) -> None:
        from ..trends.store import TrendStore

        with TrendStore.open(self.given["store"]) as trends:
            for kept in trends.add(entries):
                say(f"kept as {kept.event}, revision {kept.revision}")

    def may_write(self, place: Path, kind: str, read: Iterable[str | Path] = (), ours: bool | None = None) -> None:
        """Raise BadInput where this output would replace an input (``read``: further ones), or a file that is not ours of its kind.

        ``ours``: whether an existing file is, where its kind has no room for a remark."""
        from ..kit.files import check_output

        check_output(place, kind, inputs=[*self.inputs, *read], force=Asked.force, ours=ours)

    @property
    def inputs(self) -> list[str]:
        """Files among what was given, other than those to be written, and the project file."""
        given = [v for n, v in self.given.items() if n not in WRITTEN]
        several = [p for v in given for p in (v if isinstance(v, (list, tuple)) else [v])]
        return [str(p) for p in several if isinstance(p, (str, Path)) and os.path.isfile(p)] + [
            i.file for i in Defaults.used
        ]

    def _check_places(self) -> None:
        """Before the work: whether what it makes can be written."""
        out, plot, plot_dir, folder = (self.given.get(n) for n in ("out", "plot", "plot_dir", "folder"))
        if out is None and plot is None and plot_dir is None and folder is None:
            return
        from ..kit.files import check_folder

        if out is not None:
            self.may_write(out, "result")
        if plot is not None:
            self.may_write(plot, "picture")
        if plot is not None:
            from ..plots.figure import picture_kind

            picture_kind(plot)
        for place in (plot_dir, folder):
            if place is not None:
                check_folder(place)
