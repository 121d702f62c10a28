"""The page on execution errors: one file, verdict first, an alarm where there is one."""

import json
import re

import pytest

from asflown.estimate.gates import gates, gates_judgement
from asflown.maneuvers.history import past_model
from asflown.report.gates_page import write_gates_report
from asflown.sim.maneuver_sets import RCS_SET, a_branch, execute

RCS = past_model("rcs/2008-01").model


@pytest.mark.parametrize(
    "burns, verdict", [(a_branch(RCS, 0.15, 1), "ALARM"), (execute(RCS, RCS_SET, 1).take(range(5)), "WATCH")]
)
def test_law_verdict_first_nothing_fetched_ids_their_own(burns, verdict, tmp_path):
    fit = gates(burns)
    result = fit.with_judgement(gates_judgement(fit, draws=20)).with_doubts("a & <b>")
    twin = write_gates_report(result, tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text()
    body = text[text.index("<body>") :]
    assert body.index(verdict) < body.index("Model and judgement") < body.index("<svg")
    assert not re.findall(r'(?:src|href)="(?!#|data:)', text) and "a &amp; &lt;b&gt;" in text
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert len(ids) == len(set(ids)) and set(re.findall(r'(?:url\(#|href="#)([^")]+)', text)) <= set(ids)
    assert (json.loads(twin.read_text())["watch"] is None) == (len(burns) < 16)
