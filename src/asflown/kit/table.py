"""A table of a result: as text for a terminal, as HTML for a notebook."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape


@dataclass(frozen=True)
class Table:
    """Title, column heads, rows of text, and remarks beneath.  Numbers are given as text, already rounded.

    ``head`` may be empty: rows then need no names.  The first column is left-aligned, the others right-aligned."""

    title: str
    rows: tuple[tuple[str, ...], ...] = ()
    head: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def __str__(self) -> str:
        lines = [self.title]
        whole = [r for r in (self.head, *self.rows) if r]
        if whole:
            count = max(map(len, whole))
            padded = [(*r, *[""] * (count - len(r))) for r in whole]
            widths = [max(len(r[k]) for r in padded) for k in range(count)]
            for r in padded:
                cells = [f"{r[0]:<{widths[0]}}", *(f"{c:>{w}}" for c, w in zip(r[1:], widths[1:], strict=True))]
                lines.append("  " + "   ".join(cells).rstrip())
        return "\n".join([*lines, *(f"  {r}" for r in self.remarks)])

    def html(self) -> str:
        """The same as an HTML fragment; every text is escaped."""

        def row(cells, tag):
            side = ' style="text-align:left"'
            return "<tr>" + "".join(
                f"<{tag}{side if not k else ''}>{escape(c)}</{tag}>" for k, c in enumerate(cells)
            ) + "</tr>"  # fmt: skip

        head = f"<thead>{row(self.head, 'th')}</thead>" if self.head else ""
        body = "".join(row(r, "td") for r in self.rows)
        remarks = "".join(f"<p>{escape(r)}</p>" for r in self.remarks)
        return f"<table><caption>{escape(self.title)}</caption>{head}<tbody>{body}</tbody></table>{remarks}"
