"""The house itself: which room may know which, and what a cold start may cost."""

import ast
import graphlib
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

#: Within ``estimate``, sub-package -> sub-packages whose face it may import.
MAY_IMPORT_IN_ESTIMATE = {
    "subject": set(),
    "wheels": set(),
    "gates": set(),
    "fused": {"subject"},
    "redundancy": {"subject"},
    "firing": {"subject"},
    "environment": {"subject"},
    "inertia": {"environment", "redundancy", "subject"},
    "sources": {"environment", "redundancy", "subject"},
    "external": {"environment", "redundancy", "subject"},
    "torque": {"environment", "fused", "firing", "redundancy", "subject"},
    "thrust": {"firing", "subject"},
    "leak": {"firing", "subject"},
    "density": {"torque", "fused", "firing", "subject"},
    "jets": {"density", "fused", "subject"},
}

#: Packages that others enter by their face, the names in their ``__init__.py``.
FACES = [f"estimate.{name}" for name in MAY_IMPORT_IN_ESTIMATE] + [
    *(f"sim.{name}" for name in ("scenario", "flight", "mission")),
    *(f"trends.{name}" for name in ("store", "statistics", "entries")),
]


def imported(path: Path):
    """(module, name) for everything that a file of asflown imports from asflown; the module as a tuple of its parts."""
    parts = path.relative_to(SRC).parts[:-1]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            tail = tuple(node.module.split(".")) if node.module else ()
            if node.level:
                module = parts[: len(parts) - node.level + 1] + tail
            elif tail[0] == "asflown":
                module = tail[1:]
            else:
                continue
            for a in node.names:
                yield module, a.name


def module_name(path: Path) -> tuple[str, ...]:
    """Parts of a module's dotted name below asflown; a package is named without its __init__."""
    parts = path.relative_to(SRC).with_suffix("").parts
    return parts[:-1] if parts[-1] == "__init__" else parts


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
    assert {p.name for p in SRC.iterdir() if (p / "__init__.py").is_file()} == set(MAY_IMPORT)


@pytest.mark.parametrize("room", MAY_IMPORT)
def test_imports_follow_the_data(room):
    assert imports_of(room) <= MAY_IMPORT[room]


def test_sim_takes_no_more_of_dynamics_than_the_world_flown_through():
    taken = {m[1] for p in (SRC / "sim").rglob("*.py") for m, _ in imported(p) if m[:1] == ("dynamics",)}
    assert taken == {
        "flyby", "plume", "drag",  # bodies that are passed
        "orbit", "frames", "magnetic_field", "sun", "thermosphere", "environment",  # the Earth, orbited
    }  # fmt: skip


def test_every_room_of_estimate_is_known():
    estimate = SRC / "estimate"
    assert {p.name for p in estimate.iterdir() if (p / "__init__.py").is_file()} == set(MAY_IMPORT_IN_ESTIMATE)
    assert [p.name for p in estimate.glob("*.py")] == ["__init__.py"]


@pytest.mark.parametrize("room", MAY_IMPORT_IN_ESTIMATE)
def test_imports_within_estimate_follow_the_arrows(room):
    taken = {m[1] for p in (SRC / "estimate" / room).rglob("*.py") for m, _ in imported(p) if m[:1] == ("estimate",)}
    assert taken - {room} <= MAY_IMPORT_IN_ESTIMATE[room]


@pytest.mark.parametrize("face", FACES)
def test_others_enter_by_the_face(face):
    parts = tuple(face.split("."))
    public = ast.literal_eval(
        next(
            n.value
            for n in ast.parse((SRC.joinpath(*parts) / "__init__.py").read_text()).body
            if isinstance(n, ast.Assign) and n.targets[0].id == "__all__"
        )
    )
    wrong = [
        (str(path.relative_to(SRC)), ".".join(module), name)
        for path in SRC.rglob("*.py")
        if module_name(path)[: len(parts)] != parts
        for module, name in imported(path)
        if module[: len(parts)] == parts and (module != parts or name not in public)
    ]
    assert not wrong


@pytest.mark.parametrize("face", FACES)
def test_a_face_is_short_and_computes_nothing(face):
    path = SRC.joinpath(*face.split(".")) / "__init__.py"
    text = path.read_text()
    assert len(text.splitlines()) < 40
    body = ast.parse(text).body
    assert ast.get_docstring(ast.parse(text))
    assert all(isinstance(n, ast.ImportFrom) for n in body[1:-1]) and isinstance(body[-1], ast.Assign)
    public = set(ast.literal_eval(body[-1].value))
    modules = {p.stem for p in path.parent.glob("*.py")}
    assert not public & modules, "a module bears the name of what its face shows"


def test_no_module_circle():
    """All import statements count: at the top, inside functions, and those that only type checkers run."""
    files = {module_name(p): p for p in SRC.rglob("*.py")}
    edges = {
        name: {(*m, n) if (*m, n) in files else m for m, n in imported(path)} & set(files) - {name}
        for name, path in files.items()
        if name  # the package itself names all that is public
    }
    graphlib.TopologicalSorter(edges).prepare()  # raises CycleError, which names the circle


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


def words_that_decide(path: Path):
    """Line numbers at which code looks for words in a doubt: `"…" in d`, `d.startswith(…)`, a pattern on `str(d)`."""

    def is_doubt(node) -> bool:
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "str" and node.args:
            return is_doubt(node.args[0])
        return isinstance(node, ast.Name) and node.id in ("d", "doubt", "said", "sentence")

    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Compare) and any(isinstance(o, ast.In | ast.NotIn) for o in node.ops):
            if is_doubt(node.comparators[0]) or (
                isinstance(node.left, ast.Constant)
                and isinstance(node.left.value, str)
                and "doubts" in ast.unparse(node.comparators[0])
            ):
                yield node.lineno
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            looks = node.func.attr in ("startswith", "endswith", "replace", "partition", "split", "find", "index")
            searched = node.func.attr in ("sub", "search", "match", "fullmatch") and any(is_doubt(a) for a in node.args)
            if (looks and is_doubt(node.func.value)) or searched:
                yield node.lineno


def test_no_code_decides_by_the_words_of_a_doubt():
    found = [(str(p.relative_to(SRC)), line) for p in SRC.rglob("*.py") for line in words_that_decide(p)]
    assert not found


def test_every_kind_of_doubt_is_declared_where_it_is_found():
    """A kind's id begins with the room, or the sub-package of estimate, that declares it; ids are unique by construction."""
    wrong = []
    for path in SRC.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Kind" and node.args:
                if not isinstance(node.args[0], ast.Constant):
                    continue
                name = str(node.args[0].value)
                parts = path.relative_to(SRC).parts
                room = parts[1] if parts[0] == "estimate" else parts[0]
                if path.name != "doubts.py" or parts[0] != "kit":
                    wrong += [] if name.partition(".")[0] == room else [(str(path.relative_to(SRC)), name)]
    assert not wrong


#: Functions that may be longer: compiled kernels, and verbs whose options are their arguments.
LONG = {"kit/regression.py": "_evaluate", "estimate/fused/corner_sampler.py": "sample", "estimate/gates/kernel.py": "evaluate",
        "kit/smoother.py": "_slopes", "cli/torque.py": "torque", "cli/thrust.py": "thrust", "cli/jets.py": "jets"}  # fmt: skip


def test_no_function_is_longer_than_sixty_lines():
    """Docstrings apart; sim/flight/plant.py is one compiled kernel in pieces."""
    found = {}
    for path in SRC.rglob("*.py"):
        name = str(path.relative_to(SRC))
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                text = ast.get_docstring(node, clean=False)
                lines = node.end_lineno - node.lineno + 1 - (text.count("\n") + 1 if text else 0)
                if lines > 60 and name != "sim/flight/plant.py":
                    found[name] = node.name
    assert found == LONG
