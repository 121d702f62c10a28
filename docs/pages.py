"""Pages made from the program itself: docs/doubts.md from the kinds of doubt, docs/architecture.md from the imports.

python docs/pages.py        # writes them anew; tests/test_docs.py holds them current
"""

from __future__ import annotations

import ast
import pkgutil
from importlib import import_module
from pathlib import Path

import asflown
from asflown.kit.doubts import kinds

DOCS = Path(__file__).resolve().parent
SRC = Path(asflown.__file__).resolve().parent

#: What a room is for, from the bottom up; who may import whom is in tests/test_house.py.
ROOMS = {
    "kit": "units, time, regression, smoothing, doubts, the base of every result; knows no spacecraft",
    "craft": "the vehicle, described once, as it was on a date",
    "telemetry": "the door: any table in, checked channels in SI out",
    "maneuvers": "tables of maneuvers and the papers' models of their errors",
    "dynamics": "equations of the body, its wheels, its loop, and the world it flies through",
    "sim": "the closed-loop simulator; shares with the estimators only the world flown through",
    "estimate": "the estimators, twelve sub-packages",
    "trends": "what was found of every event, kept for years, and its verdict",
    "plots": "pictures of results; computes nothing",
    "campaigns": "many flights: error budgets, searches",
    "report": "pages for a board",
    "cli": "one verb a file",
}

#: A wheel rate from the file to the report: module, function or class, what it does.
WALK = (
    ("cli.trend.add", "add", "the verb reads its options"),
    ("telemetry.load", "load_telemetry", "reads the file: columns become channels in SI on a TAI axis"),
    ("telemetry.screening", "screen", "marks samples that must not be used, and counts what it found"),
    ("trends.entries.actuation", "analyse", "cuts the event out of the record"),
    ("estimate.subject.subject", "subject_of", "joins the telemetry with the craft as it was on that date"),
    ("estimate.fused.gather", "gather", "arranges the wheel rate, now momentum, beside rates and attitude error"),
    ("estimate.fused.levels", "fit_levels", "finds the noise of each channel by likelihood"),
    ("estimate.fused.corners", "draw_torques", "draws torques from their joint posterior"),
    ("estimate.torque.result", "TorqueResult", "holds the torque, its band, its doubts and its provenance"),
    ("trends.entries.figures", "measure", "turns the torque into figures of merit with their sigma"),
    ("trends.store.store", "TrendStore", "keeps the entry, never to be changed"),
    ("trends.verdicts", "judge", "sets the newest event against all earlier ones"),
    ("report.page", "write_report", "writes the page, the verdict first"),
)


def every_module() -> list[str]:
    """Import all of asflown, so that every kind of doubt is declared; names of the modules."""
    names = [m.name for m in pkgutil.walk_packages(asflown.__path__, "asflown.") if ".migrations" not in m.name]
    for name in names:
        if not name.endswith(("cli.prewarm",)):
            import_module(name)
    return names


def doubts_page() -> str:
    """docs/doubts.md."""
    every_module()
    lines = [
        "# Doubts",
        "",
        "A result says what may be wrong with it. Every doubt has a kind, listed here, and one of four severities:",
        "",
        "| severity | meaning |",
        "|---|---|",
        "| note | a choice was made for you |",
        "| caution | a known error is not in the sigma |",
        "| suspect | the data contradict the model |",
        "| void | the result says nothing |",
        "",
        "Text and figures show the gravest first and mark suspect and void with `DOUBT!`. In JSON the sentences stand in `doubts`, and",
        "`doubts_detail` adds kind, severity, numbers, names, remedy and origin. From Python, ask for a kind by its object:",
        "`result.doubts.has(KIND)`; `result.doubts.worst` is the gravest severity.",
        "",
        "This page is made from the program (`python docs/pages.py`). Words in braces are filled in.",
    ]
    rooms: dict[str, list] = {}
    for kind in kinds().values():
        if kind.id.startswith("test."):  # of the test suite
            continue
        rooms.setdefault(kind.id.partition(".")[0], []).append(kind)
    for room, found in rooms.items():
        lines += ["", f"## {room}", "", "| kind | severity | sentence | what you can do |", "|---|---|---|---|"]
        for k in found:
            cells = (f"`{k.id}`", k.severity.label, k.says, k.remedy)
            lines.append("| " + " | ".join(c.replace("|", "\\|").replace("\n", " ") for c in cells) + " |")
    return "\n".join(lines) + "\n"


def imports_between(folder: Path, names: list[str]) -> dict[str, set[str]]:
    """Which of the sub-packages ``names`` of a folder import which, read from the source."""
    prefix = folder.relative_to(SRC).parts
    found: dict[str, set[str]] = {n: set() for n in names}
    for name in names:
        for path in (folder / name).rglob("*.py"):
            parts = path.relative_to(SRC).parts[:-1]
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if not isinstance(node, ast.ImportFrom):
                    continue
                tail = tuple(node.module.split(".")) if node.module else ()
                module = parts[: len(parts) - node.level + 1] + tail if node.level else tail[1:]
                if not node.level and tail[:1] != ("asflown",):
                    continue
                into = module[len(prefix) :] if module[: len(prefix)] == prefix else ()
                targets = {into[0]} if into else {a.name for a in node.names if module == prefix}
                found[name] |= (targets & set(names)) - {name}
    return found


def _floors(arrows: dict[str, set[str]]) -> list[list[str]]:
    """From the top down: every name stands above all that it imports."""
    height: dict[str, int] = {}

    def of(name: str) -> int:
        if name not in height:
            height[name] = 1 + max((of(n) for n in arrows[name]), default=0)
        return height[name]

    for name in arrows:
        of(name)
    return [[n for n in arrows if height[n] == h] for h in range(max(height.values()), 0, -1)]


def _graph(arrows: dict[str, set[str]]) -> list[str]:
    """A Mermaid drawing; an arrow that follows from two others is left out."""

    def reached(name: str) -> set[str]:
        return set().union(*({n} | reached(n) for n in arrows[name])) if arrows[name] else set()

    lines = ["```mermaid", "graph TD"]
    for name, to in arrows.items():
        further = set().union(*(reached(n) for n in to)) if to else set()
        lines += [f"  {name} --> {n}" for n in sorted(to - further)] or [f"  {name}"]
    return [*lines, "```"]


def architecture_page() -> str:
    """docs/architecture.md."""
    rooms = imports_between(SRC, list(ROOMS))
    estimate = SRC / "estimate"
    inside = imports_between(estimate, sorted(p.name for p in estimate.iterdir() if (p / "__init__.py").is_file()))
    lines = [
        "# Architecture",
        "",
        "Data flow one way: telemetry, estimate, trends, report. No import runs upward, and no module imports itself through others.",
        "An arrow means: imports. `tests/test_house.py` holds the arrows; this page is made from the imports (`python docs/pages.py`).",
        "",
        "## Rooms",
        "",
        *_graph(rooms),
        "",
        "| floor | room | for | imports |",
        "|---|---|---|---|",
    ]
    for floor, names in enumerate(reversed(_floors(rooms)), start=1):
        lines += [f"| {floor} | `{n}` | {ROOMS[n]} | {', '.join(sorted(rooms[n])) or 'nothing'} |" for n in names]
    lines += ["", "## Inside `estimate`", "", *_graph(inside), "", "| sub-package | for | imports |", "|---|---|---|"]
    for name in inside:
        text = ast.get_docstring(ast.parse((estimate / name / "__init__.py").read_text(encoding="utf-8"))) or ""
        lines.append(
            f"| `{name}` | {text.splitlines()[0].rstrip('.')} | {', '.join(sorted(inside[name])) or 'nothing'} |"
        )
    lines += [
        "",
        "Each sub-package has a face, its `__init__.py`. Other rooms import from the face only; files inside import files.",
        "",
        "## A wheel rate from the file to the report",
        "",
        *(f"{k}. `{module}.{name}` {what}." for k, (module, name, what) in enumerate(WALK, start=1)),
    ]
    return "\n".join(lines) + "\n"


_OLD = "## Keys of the last version"


def cli_page() -> str:
    """docs/cli.md with its last section, the keys kept for one version, made anew."""
    from asflown.cli.schemas import results

    head = (DOCS / "cli.md").read_text(encoding="utf-8").partition(f"\n{_OLD}\n")[0].rstrip("\n")
    lines = [
        head,
        "",
        _OLD,
        "",
        "They hold the same values as the keys beside them, and go with the next version.",
        "",
        "| verb | old key | key |",
        "|---|---|---|",
    ]
    for verb, result in results().items():
        lines += [f"| {verb} | `{old}` | `{new}` |" for old, new in result.OLD_KEYS.items()]
    return "\n".join(lines) + "\n"


PAGES = {"doubts.md": doubts_page, "architecture.md": architecture_page, "cli.md": cli_page}

if __name__ == "__main__":
    for page, make in PAGES.items():
        (DOCS / page).write_text(make(), encoding="utf-8")
