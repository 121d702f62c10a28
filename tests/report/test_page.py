"""The report: one file, nothing fetched, its pictures' ids their own, its twin the same numbers."""

import json
import os
import re
import shutil
import subprocess

import pytest

from asflown.report.page import write_report
from asflown.trends.verdicts import judge
from trends.histories import history

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    entries = history(change=0.3, curves=True, seed=1)
    healths = [judge(entries, kind=k, cycles_allowed=20) for k in ("deploy", "stow")]
    out = tmp_path_factory.mktemp("report") / "report.html"
    twin, record = write_report(healths, out, {"options": {"store": "a & <b>"}, "inputs": []})
    return out, twin, record


def test_law_verdict_comes_first_and_everything_is_inside(page):
    text = page[0].read_text()
    body = text[text.index("<body>") :]
    assert body.index("WATCH") < body.index("figures of merit") < body.index("<svg")
    assert not re.findall(r'(?:src|href)="(?!#|data:)', text)  # nothing is fetched
    assert "url(http" not in text and "<script" not in text and "@import" not in text
    assert "a &amp; &lt;b&gt;" in text


def test_law_ids_are_their_own_and_references_meet_them(page):
    text = page[0].read_text()
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'(?:url\(#|href="#)([^")]+)', text)) <= set(ids)
    assert "#010203" not in text and re.search(r"var\(--g[0-9]\)", text.split("<body>")[1]) and "currentColor" in text


def test_golden_twin_holds_the_same_numbers(page):
    record = json.loads(page[1].read_text())
    assert record["verdict"] == "watch" and [k["kind"] for k in record["kinds"]] == ["deploy", "stow"]
    figure = record["kinds"][0]["figures"][0]
    assert {"figure", "rows", "change_percent", "change_percent_ci95", "p_value", "slope_per_year"} <= set(figure)
    assert f"{figure['change_percent']:+.0f} %" in page[0].read_text()


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
@pytest.mark.parametrize("width", [1400, 390])
def test_law_page_opens_in_a_browser_without_complaint(page, width, tmp_path):
    """No console message, and the page is no wider than the window (tables and pictures scroll in themselves)."""
    shot = os.environ.get("ASFLOWN_SCREENSHOTS", str(tmp_path)) + f"/report-{width}.png"
    probe = (
        page[0]
        .read_text()
        .replace(
            "</body>",
            "<script>console.log('widths ' + document.documentElement.scrollWidth + ' ' + innerWidth)</script></body>",
        )
    )
    path = tmp_path / "probe.html"
    path.write_text(probe)
    ran = subprocess.run(
        [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--v=0", "--hide-scrollbars",
         f"--user-data-dir={tmp_path / 'profile'}", f"--screenshot={shot}", f"--window-size={width},3000", path.as_uri()],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    said = re.findall(r"CONSOLE[^\n]*?\] ?\"(.*?)\", source", ran.stderr)
    assert len(said) == 1 and said[0].startswith("widths"), ran.stderr[-2000:]
    wide, window = (int(n) for n in said[0].split()[1:])
    assert wide <= window
    assert os.path.getsize(shot) > 10_000
