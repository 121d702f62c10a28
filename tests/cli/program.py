"""Running the program inside the test process, and small telemetry to run it on."""

import contextlib
import io
import json
import math
import re
import sys
from dataclasses import dataclass
from unittest.mock import patch

import numpy as np


@dataclass(frozen=True)
class Run:
    code: int
    out: str
    err: str

    @property
    def record(self) -> dict:
        """The one JSON object on standard output, read strictly."""
        return strict_json(self.out)


#: Verbs that need a craft, but for the words after them that do not.
NEED_CRAFT = {
    *("torque", "wheels", "external-torque", "density", "jets", "leak", "thrust", "budget", "tune", "inertia", "gates"),
    "trend add",
}
NEED_NONE = ("gates watch", "gates predict", "gates simulate", "gates history")


#: What a slow machine gets to read of long work.
_PROGRESS = re.compile(r"^.*\b(so far|left)\n", re.MULTILINE)


def run(*words, craft: str | None = "cassini") -> Run:
    """`asflown WORDS...` with its exit code and both its outputs; of Cassini unless the words or ``craft`` say otherwise."""
    from asflown.cli.main import main

    out, err = io.StringIO(), io.StringIO()
    argv = ["asflown", *map(str, words)]
    verbs = {" ".join(argv[1:2]), " ".join(argv[1:3])}
    bare = "--craft" in argv or "--help" in argv or verbs.intersection(NEED_NONE) or len(argv) == 2
    if craft is not None and not bare and verbs.intersection(NEED_CRAFT):
        words_of_verb = 3 if argv[2] in ("add", "plan", "history", "fit") else 2
        argv[words_of_verb:words_of_verb] = ["--craft", craft]  # before what may lack its value
    code: object = 0
    with patch.object(sys, "argv", argv), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            code = end.code
    return Run(int(code or 0), out.getvalue(), _PROGRESS.sub("", err.getvalue()))


def strict_json(text: str) -> dict:
    """One object on one line, without the NaN and Infinity that JSON does not have."""

    def refuse(word):
        raise AssertionError(f"{word} is not JSON")

    assert text.endswith("}\n") and text.count("\n") == 1
    return json.loads(text, parse_constant=refuse)


def complaint(*words, craft: str | None = "cassini") -> str:
    """The one error message of a run that must be refused."""
    done = run(*words, craft=craft)
    assert done.code == 2, (done.code, done.err[:600], done.out[:200])
    if "--json" in words:
        told = strict_json(done.out)
        assert told["exit_code"] == 2 and told["error"]["what"] and told["error"]["remedy"]
    else:
        assert done.out == ""
    assert done.err.startswith("error: ") and done.err.count("error: ") == 1
    assert len(done.err) < 1500
    assert len(done.err.splitlines()) >= 2, f"no remedy: {done.err}"
    assert "Traceback" not in done.err and "fault of asflown" not in done.err
    return done.err


# ---- telemetry --------------------------------------------------------------------------------

WHEELS = ("RWA1", "RWA2", "RWA4")
T = np.arange(0.0, 481.0, 4.0)


def flight(seed: int = 1, wheels=WHEELS) -> dict[str, np.ndarray]:
    """Eight minutes in a hold, a torque pulse about y in the middle: headings and columns.  Not a simulation:
    the wheels take up the pulse's impulse, and nothing else moves."""
    rng = np.random.default_rng(seed)
    torque = 0.02 * np.clip(1 - np.abs(T - 240) / 40, 0, None)  # N m
    gained = np.cumsum(torque) * 4.0
    table = {"time [s]": T}
    along_y = {"RWA1": 0.8164965809, "RWA2": -0.4082482905, "RWA3": -0.4082482905, "RWA4": -0.4082482905}
    for k, w in enumerate(wheels):
        share = gained * along_y.get(w, 0.0) / 0.161
        table[f"wheel_rate_{w} [rad/s]"] = 60.0 - 25.0 * k + share + 0.005 * rng.standard_normal(T.size)
    for a in "xyz":
        table[f"body_rate_{a} [rad/s]"] = 2e-6 * rng.standard_normal(T.size)
    response = {"x": 0.0, "y": -4e-4, "z": 0.0}
    for a in "xyz":
        table[f"attitude_error_{a} [rad]"] = response[a] * torque / 0.02 + 8e-6 * rng.standard_normal(T.size)
    return table


def csv_text(table: dict, epoch: str | None = "2015-09-29T00:00:00 UTC") -> str:
    """A self-describing table; NaN is written as a blank."""
    lines = [] if epoch is None else [f"# epoch: {epoch}"]
    lines.append(",".join(table))
    lines += [
        ",".join(v if isinstance(v, str) else "" if math.isnan(v) else repr(float(v)) for v in row)
        for row in zip(*table.values(), strict=True)
    ]
    return "\n".join(lines) + "\n"
