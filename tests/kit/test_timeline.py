"""Time: leap seconds, scales and gaps."""

import numpy as np
import pytest

from asflown.kit.errors import BadInput
from asflown.kit.timeline import NS, et_to_tai_ns, gps_to_tai_ns, segments, utc_label, utc_to_tai_ns


def test_law_a_leap_second_counts():
    before, after = utc_to_tai_ns(["2016-12-31T23:59:59", "2017-01-01T00:00:01"])
    assert after - before == 3 * NS
    assert utc_label(int(before) + NS) == "2016-12-31T23:59:60"


def test_published_gps_is_nineteen_seconds_behind_tai():
    # The ISS recording's own README: GPS 1223355573 is 2018-10-12 04:59:15 UTC.
    assert int(gps_to_tai_ns(1223355573.0)) == utc_to_tai_ns("2018-10-12T04:59:15")


def test_published_ephemeris_time_zero_is_j2000():
    # J2000 = 2000-01-01T12:00:00 TDB = 11:58:55.816 UTC, to the millisecond.
    assert abs(int(et_to_tai_ns(0.0)[0]) - utc_to_tai_ns("2000-01-01T11:58:55.816")) < NS // 1000


@pytest.mark.parametrize(
    "text", ["2015-272T00:00:00", "2015-09-29T00:00:00Z", "2015-09-29 00:00:00 UTC", "2015:272:00:00:00", "2015-09-29"]
)
def test_the_ways_people_write_a_time(text):
    assert utc_label(utc_to_tai_ns(text)) == "2015-09-29T00:00:00"


def test_dates_beyond_the_tables_still_convert():
    assert utc_label(utc_to_tai_ns("2041-06-01T00:00:00")) == "2041-06-01T00:00:00"


@pytest.mark.parametrize("text", ["yesterday", "2015-13-01T00:00:00", "", "29/09/2015"])
def test_what_is_not_a_time_is_refused(text):
    with pytest.raises(BadInput, match="not a time"):
        utc_to_tai_ns(text)


def test_five_missing_samples_are_bridged_and_six_are_a_gap():
    t = np.arange(40) * 4 * NS
    five = np.delete(t, slice(10, 15))
    six = np.delete(t, slice(10, 16))
    assert len(segments(five, 5, 4 * NS)) == 1
    assert [s.stop - s.start for s in segments(six, 5, 4 * NS)] == [10, 24]
