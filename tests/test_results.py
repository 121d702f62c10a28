"""One face for every result: what a user may ask of any of them.  Laws of the interface; numbers are tested in their rooms."""

import json
import math
import re
import tempfile
import warnings
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import asflown
from asflown.kit.doubts import Doubts
from asflown.kit.errors import BadInput
from asflown.kit.plain import plain
from asflown.kit.result import Estimate
from asflown.sim.maneuver_sets import RCS_SET, execute
from flights import CASSINI, flown


@cache
def maneuvers():
    return execute(asflown.past_model("rcs/2012-1").model, RCS_SET, 1)


def plan():
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plan.csv"
        path.write_text("id,dv [m/s]\nA,0.05\nB,1.2\n")
        return asflown.load_plan(path)


def span_search():
    from asflown.campaigns.tune import tune

    return tune(CASSINI, spans=(0.06, 0.08), rises=(15.0,))


def telemetry(scenario):
    return flown(scenario).telemetry


E3 = ("E3", "2008-03-12T19:06:12")

#: What makes each result, as cheaply as it goes.
MADE = {
    "TorqueResult": lambda: asflown.torque(telemetry("profile-1"), CASSINI, method="momentum", axis="y"),
    "TorqueResult, fused": lambda: asflown.torque(telemetry("profile-1"), CASSINI, axis="y", prior="matern"),
    "TorqueResult, transfer": lambda: asflown.torque(telemetry("profile-1"), CASSINI, method="transfer", axis="y"),
    "ExternalTorqueResult": lambda: asflown.external_torque(telemetry("quiet"), CASSINI),
    "SourcesResult": lambda: asflown.sources(telemetry("leo-nadir"), asflown.load_craft("pyramid")),
    "WheelsResult": lambda: asflown.wheels(telemetry("wheel-run-down"), CASSINI),
    "InertiaResult": lambda: asflown.inertia(telemetry("slews"), CASSINI, method="axis"),
    "SlewPlanResult": lambda: asflown.slew_plan(CASSINI, telemetry("slews")),
    "ThrustResult": lambda: asflown.thrust(telemetry("wheel-bias-day28"), CASSINI, method="printed"),
    "LeakResult": lambda: asflown.leak(telemetry("leak"), CASSINI),
    "DensityResult": lambda: asflown.density(telemetry("e3"), CASSINI, *E3, method="momentum"),
    "JetsResult": lambda: asflown.jets(telemetry("e3"), CASSINI, *E3, method="momentum"),
    "GatesResult": lambda: asflown.gates(maneuvers()),
    "GatesPredictionResult": lambda: asflown.gates_prediction(plan(), asflown.past_model("rcs/2012-1")),
    "InertiaHistoryResult": lambda: asflown.inertia_history(CASSINI),
    "ErrorBudget": lambda: asflown.error_budget("profile-1", CASSINI, ["momentum-printed"], runs=2),
    "SpanSearch": lambda: span_search(),
    "GatesWatchResult": lambda: asflown.gates_watch(maneuvers(), first="rcs-40"),
}


@cache
def made(name: str):
    return MADE[name]()


@pytest.fixture(params=MADE)
def result(request):
    return made(request.param)


def every_result_class():
    from asflown.cli.schemas import results

    return set(results().values())


def test_every_result_of_a_verb_is_an_estimate_and_is_tried_here():
    tried = {name.split(",")[0] for name in MADE}
    assert {c.__name__ for c in every_result_class()} <= tried
    assert all(issubclass(c, Estimate) for c in every_result_class())


def test_text_html_and_repr(result):
    assert isinstance(result, Estimate) and isinstance(result.doubts, Doubts)
    text, html = str(result), result._repr_html_()
    assert text == result.table() and " +- " not in text
    assert html.startswith("<table>") and html.count("<table>") == html.count("</table>")
    assert repr(result).startswith(f"<{type(result).__name__}") and len(repr(result)) < 160
    assert all(str(d)[:20].split("<")[0] in html.replace("&#x27;", "'").replace("&lt;", "<") for d in result.doubts)


def test_record_is_plain_and_carries_doubts(result):
    record = plain(result.record())
    json.dumps(record, allow_nan=False)
    assert record["doubts"] == [d["sentence"] for d in record["doubts_detail"]] == result.doubts.sentences()
    assert {"provenance", "command"}.isdisjoint(record)


def test_old_keys_hold_what_the_new_ones_hold(result):
    record = plain(result.record())
    for old, new in result.OLD_KEYS.items():
        place, _, name = old.rpartition("[].")
        for row in [record] if not place else record.get(place) or []:
            assert (new in row) <= (row.get(name, math.nan) == row.get(new)), (old, new)


def test_record_fits_its_schema(result):
    import jsonschema

    from asflown.kit.schema import json_schema

    schema = json_schema("any", result.RECORD, result.OLD_KEYS)
    whole = {"command": "any", **plain(result.record()), "provenance": plain(result.provenance)}
    jsonschema.validate(whole, schema)
    told = set(schema["properties"])
    assert set(whole) <= told, f"not in the record's type: {sorted(set(whole) - told)}"


def test_provenance_names_inputs_versions_and_options(result, tmp_path):
    p = result.provenance
    assert p["versions"]["asflown"] and isinstance(p["options"], dict)
    json.dumps(plain(p), allow_nan=False)


def test_it_is_saved_whole_and_with_its_provenance(result, tmp_path):
    result.save(tmp_path / "r.json")
    kept = json.loads((tmp_path / "r.json").read_text())
    assert kept["provenance"] == plain(result.provenance) and kept["doubts"] == result.doubts.sentences()
    with pytest.raises(BadInput, match="cannot save"):
        result.save(tmp_path / "r.xyz")
    if result.series() is None:
        with pytest.raises(BadInput, match="not a function of time"):
            result.save(tmp_path / "r.csv")
        return
    result.save(tmp_path / "r.csv")
    result.save(tmp_path / "r.parquet")
    import duckdb

    text = (tmp_path / "r.csv").read_text()
    assert text.startswith("# ") and text.count("DOUBT") == len(result.doubts)
    rows = len([x for x in text.splitlines() if not x.startswith("#")]) - 1
    with duckdb.connect() as link:
        assert link.execute(f"SELECT count(*) FROM '{tmp_path / 'r.parquet'}'").fetchone() == (rows,)
        keys = dict(link.execute(f"SELECT key, value FROM parquet_kv_metadata('{tmp_path / 'r.parquet'}')").fetchall())
    assert json.loads(keys[b"asflown"])["provenance"] == plain(result.provenance)


def test_frames(result):
    series = result.series()
    if series is None:
        with pytest.raises(TypeError, match="function of time"):
            result.to_pandas()
        return
    frame, data = result.to_pandas(), result.to_xarray()
    assert frame.index.name == "time_s" and len(frame) == data.sizes["time_s"] == len(series.time_s)
    assert frame.attrs["doubts"] == result.doubts.sentences() and data.attrs["craft"] == result.craft
    for name, values in series.columns.items():
        assert np.array_equal(
            np.asarray(data[name]), np.asarray(values), equal_nan=np.asarray(values).dtype.kind == "f"
        )


def test_it_draws_into_given_axes(result, tmp_path):
    from asflown.plots import _DRAWN, save_figure
    from asflown.plots.figure import new_figure

    if type(result).__name__ not in _DRAWN:
        with pytest.raises(TypeError, match="no picture"):
            result.plot()
        return
    ax = new_figure()[1][0]
    assert result.plot(ax=ax) is ax and (ax.lines or ax.collections or ax.patches)
    save_figure(result, tmp_path / "whole.svg")
    assert (tmp_path / "whole.svg").stat().st_size > 2000


def test_names_of_the_last_version_work_and_warn():
    for old, new in asflown._RENAMED.items():
        with pytest.warns(DeprecationWarning, match=new):
            assert getattr(asflown, old) is getattr(asflown, new)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in asflown.__all__:
            getattr(asflown, name)


def test_public_functions_name_their_options_and_are_documented():
    """numpydoc sections; no **options, no option without a name, no boolean by position."""
    import inspect

    for name in asflown.__all__:
        function = getattr(asflown, name)
        if not inspect.isfunction(function) or not hasattr(function, "__wrapped__"):
            continue
        signature = inspect.signature(function)
        kinds = {p.kind for p in signature.parameters.values()}
        assert not kinds & {inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL}, name
        text = inspect.getdoc(function) or ""
        for section in (
            "Parameters\n---",
            "Returns\n---",
            *(("Raises\n---",) if len(signature.parameters) > 1 else ()),
        ):
            assert section in text, f"{name}: no {section.split()[0]}"
        undocumented = [p for p in signature.parameters if not re.search(rf"^(\w+, )*{p}(, \w+)*( :.*)?$", text, re.M)]
        assert not undocumented, f"{name}: {undocumented}"
