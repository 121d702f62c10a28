"""Whatever happens to a good file on its way, the program answers: a result, or one complaint."""

import random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cli.program import csv_text, flight, run

LINES = csv_text({k: v[:41] for k, v in flight().items()}).splitlines()
WORDS = ["", " ", "0", "-0.0", "1e5", "-1e-300", "1e59", "1e999", "nan", "inf", "-", "1,5", "1;5", '"', "''", "#", "=1+1", "NULL",
         "0x1F", "1_000", "٣", "é", "\ufeff", "\t", "2015-09-29T00:00:00", "60.0", "1e18", "[rad/s]", "time [utc]", "wheel_rate_RWA1 [rpm]"]  # fmt: skip


def mutated(seed: int, count: int) -> bytes:
    """A good table after ``count`` accidents."""
    rng = random.Random(seed)
    lines = list(LINES)
    for _ in range(count):
        kind = rng.randrange(12)
        i = rng.randrange(len(lines)) if lines else 0
        if not lines:
            break
        if kind == 0:
            del lines[i]
        elif kind == 1:
            lines.insert(i, lines[rng.randrange(len(lines))])
        elif kind == 2:
            j = rng.randrange(len(lines))
            lines[i], lines[j] = lines[j], lines[i]
        elif kind == 3:
            lines[i] = lines[i][: rng.randrange(len(lines[i]) + 1)]
        elif kind in (4, 5, 6, 7):
            cells = lines[i].split(",")
            cells[rng.randrange(len(cells))] = rng.choice(WORDS)
            lines[i] = ",".join(cells)
        elif kind == 8:
            column, word = rng.randrange(10), rng.choice(WORDS)
            for k in range(2, len(lines)):
                cells = lines[k].split(",")
                cells[min(column, len(cells) - 1)] = word
                lines[k] = ",".join(cells)
        elif kind == 9:
            start = rng.randrange(2, 30)
            del lines[start : start + rng.randrange(1, 12)]
        elif kind == 10:
            lines = lines[: rng.randrange(1, len(lines) + 1)]
        else:
            at = rng.randrange(len(lines[i]) + 1)
            lines[i] = lines[i][:at] + chr(rng.choice([34, 35, 44, 59, 91, 93, 46, 45, 101, 48, 57])) + lines[i][at:]
    data = "\n".join(lines).encode()
    if rng.random() < 0.1 and data:
        at = rng.randrange(len(data))
        data = data[:at] + rng.randbytes(rng.randrange(1, 6)) + data[at + 1 :]
    return data


QUIETLY = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])


def answers(*words) -> None:
    done = run(*words)
    assert done.code in (0, 2, 3), done.err
    if done.code == 2:
        assert done.out == "" or done.record["error"]["what"]
        assert done.err.startswith("error: ") and len(done.err) < 1500
        assert "Traceback" not in done.err
    else:
        assert done.record and all(line.startswith("not compared, ") for line in done.err.splitlines())


@settings(QUIETLY, max_examples=30)
@given(seed=st.integers(0, 10**9), count=st.integers(1, 4))
def test_any_accident_to_a_file_gets_an_answer(seed, count, tmp_path):
    path = tmp_path / "t.csv"
    path.write_bytes(mutated(seed, count))
    answers("telemetry", "check", path, "--json")
    method = ["momentum", "transfer", "polynomial"][seed % 3]  # fused comes in with --compare, in the slow campaign
    answers("torque", path, "--json", "--method", method, "--variant", ["corrected", "printed"][seed // 3 % 2])


@settings(QUIETLY, max_examples=30)
@given(option=st.sampled_from(["--start", "--stop", "--inertia", "--cm", "--axis", "--window", "--order", "--model", "--craft", "--moving"]),
       value=st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=12) | st.floats().map(repr) | st.integers().map(str))  # fmt: skip
def test_any_value_of_an_option_gets_an_answer(option, value, tmp_path):
    path = tmp_path / "t.csv"
    if not path.exists():
        path.write_text("\n".join(LINES))
    answers("torque", path, "--json", f"{option}={value}")


@pytest.mark.slow
@settings(QUIETLY, max_examples=200)
@given(seed=st.integers(0, 10**9), count=st.integers(1, 8))
def test_any_accident_many_times(seed, count, tmp_path):
    path = tmp_path / "t.csv"
    path.write_bytes(mutated(seed, count))
    answers("telemetry", "check", path, "--json")
    answers("torque", path, "--json", "--compare")


def test_values_of_any_size_give_finite_results(tmp_path):
    """Scaling every wheel rate scales the momentum, whatever the size."""
    path = tmp_path / "t.csv"
    for scale in (1e-30, 1e-9, 1.0, 1e9, 1e30):
        table = {k: v * scale if "wheel" in k else v for k, v in flight().items() if "wheel" in k or "time" in k}
        path.write_text(csv_text(table))
        record = run("torque", path, "--json").record
        assert np.isfinite(np.array(record["torque_Nm"], float)).all()
