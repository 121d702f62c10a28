"""The house itself: which room may know which, and what a cold start may cost."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

SRC = Path(__file__).resolve().parents[1] / "src" / "asflown"

#: Room -> rooms it may import from.  sim and dynamics stand side by side: the one integrates, the other
#: inverts, and a mistake in either must show against the other.  They share only the world that is flown through.
MAY_IMPORT = {
    "kit": set(),
    "craft": {"kit"},
    "telemetry": {"kit", "craft"},
    "maneuvers": {"kit", "telemetry"},
    "dynamics": {"kit", "craft"},
    "sim": {"kit", "craft", "telemetry", "maneuvers", "dynamics"},
    "estimate": {"kit", "craft", "telemetry", "maneuvers", "dynamics"},
    "plots": {"kit", "craft", "telemetry", "maneuvers", "dynamics", "estimate", "trends"},
    "trends": {"kit", "craft", "telemetry", "dynamics", "estimate"},
    "campaigns": {"kit", "craft", "telemetry", "dynamics", "sim", "estimate", "trends"},
    "report": {"kit", "estimate", "trends", "plots"},
    "cli": {
        "kit",
        "craft",
        "telemetry",
        "maneuvers",
        "dynamics",
        "sim",
        "estimate",
        "trends",
        "plots",
        "campaigns",
        "report",
    },
}


def imports_of(room: str) -> set[str]:
    """Rooms that any module of ``room`` imports, at its top or inside a function."""
    rooms = set()
    for path in (SRC / room).rglob("*.py"):
        depth = len(path.relative_to(SRC).parts) - 1
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                if node.level > depth:
                    names = [node.module.split(".")[0]] if node.module else [a.name for a in node.names]
                    rooms |= {n for n in names if (SRC / n).is_dir()}
                elif node.level == 0 and node.module and node.module.startswith("asflown."):
                    rooms.add(node.module.split(".")[1])
            elif isinstance(node, ast.Import):
                rooms |= {a.name.split(".")[1] for a in node.names if a.name.startswith("asflown.")}
    return rooms - {room}


def test_every_room_is_known():
    assert {p.name for p in SRC.iterdir() if p.is_dir() and p.name != "__pycache__"} == set(MAY_IMPORT)


@pytest.mark.parametrize("room", MAY_IMPORT)
def test_imports_follow_the_data(room):
    assert imports_of(room) <= MAY_IMPORT[room]


def test_sim_takes_no_more_of_dynamics_than_the_world_flown_through():
    taken = set()
    for path in (SRC / "sim").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.level == 2 and (node.module or "").startswith("dynamics"):
                taken.add(node.module.removeprefix("dynamics."))
    assert taken == {"flyby", "plume", "drag"}


def test_help_loads_nothing_heavy():
    code = (
        "import sys; sys.argv = ['asflown', '--help']\n"
        "from asflown.cli.main import main\n"
        "try: main()\nexcept SystemExit as e: assert e.code == 0, e.code\n"
        "heavy = {'numpy', 'pydantic', 'astropy', 'scipy', 'matplotlib', 'numba', 'sqlalchemy'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_importing_the_package_is_free_and_every_public_name_is_there():
    code = "import sys, asflown\nassert 'numpy' not in sys.modules\nfor name in asflown.__all__: getattr(asflown, name)"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_every_verb_is_documented():
    from asflown.cli.main import app

    page = (SRC.parents[1] / "docs" / "cli.md").read_text()
    verbs = {c.name for c in app.registered_commands} | {g.name for g in app.registered_groups}
    assert verbs == {
        line.removeprefix("## asflown ").strip() for line in page.splitlines() if line.startswith("## asflown ")
    }
