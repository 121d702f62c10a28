"""JSON of the verbs that answer without a result: telemetry, craft, simulate, trend and report.

Results describe their own records (``RECORD``); ``schemas`` puts both into JSON Schemas.
"""

from __future__ import annotations

from typing import Any

from ..kit.schema import Annotated, Doc, DoubtRecord, Interval, NotRequired, Number, Numbers, Rows, TypedDict, Vector

# ---- telemetry ----


class GapRecord(TypedDict):
    start_s: Number
    stop_s: Number


class ChannelRecord(TypedDict):
    name: str
    unit: str
    samples: int
    unused: Annotated[int, Doc("samples that must not be used")]
    cadence_s: Number
    first_s: Number
    last_s: Number
    dropouts: int
    gaps: int
    gap_list: list[GapRecord]
    quantisation: Number
    noise: Number
    suspicions: list[str]


class FindingRecord(TypedDict):
    channel: Annotated[str, Doc("'' for the whole file")]
    what: str
    count: int
    first_s: Number
    detail: str


class TelemetryCheckRecord(TypedDict):
    file: str
    epoch: str | None
    channels: list[ChannelRecord]
    time_labels: list[str]
    findings: list[FindingRecord]


class NameRecord(TypedDict):
    name: str
    unit: str
    behaves: str
    meaning: str


class TelemetryNamesRecord(TypedDict):
    names: list[NameRecord]


# ---- craft ----


class BuiltInCraftRecord(TypedDict):
    name: str
    description: str
    alternatives: list[str]


class CraftListRecord(TypedDict):
    crafts: list[BuiltInCraftRecord]


class WheelRecord(TypedDict):
    name: str
    axis: Vector
    spin_inertia_kg_m2: Number


class ThrusterRecord(TypedDict):
    name: str
    position_m: Vector
    direction: Vector
    nominal_thrust_N: Number
    delay_s: Number
    rise_s: Number
    fall_s: Number
    branch: str


class WheelControllerRecord(TypedDict):
    bandwidth_Hz: Number
    damping: Number
    kp_per_s: Number
    kd_per_s: Number
    filter_rad_s: Number
    filter_damping: Number
    period_s: Number
    gyroscopic: Annotated[bool | None, Doc("whether w x H is fed forward; null: not said")]
    acceleration: Annotated[bool | None, Doc("whether inertia x commanded acceleration is; null: not said")]
    tracking: Annotated[bool, Doc("whether the rate's error is against the commanded rate")]
    inertia_kg_m2: Annotated[Rows | None, Doc("as the controller believes; null: the craft's own")]


class CraftRecord(TypedDict):
    craft: str
    at: str | None
    inertia_kg_m2: Rows | None
    inertia_per_spin_inertia: Rows | None
    wheels: list[WheelRecord]
    thrusters: list[ThrusterRecord]
    wheel_controller: WheelControllerRecord | None
    center_of_mass_m: Vector | None
    center_of_mass_assumed_m: Vector | None


class AbilityRecord(TypedDict):
    verb: str
    can: bool
    note: Annotated[str, Doc("what is missing, or what an answer rests on")]


class CraftCheckRecord(CraftRecord):
    verbs: list[AbilityRecord]


class CraftNewRecord(TypedDict):
    craft: str
    file: str


# ---- simulate ----


class SimulateRecord(TypedDict):
    """Of a scenario: scenario, files, ended; of a mission: mission, events, truth, flown, listed."""

    seed: int | None
    scenario: NotRequired[str]
    files: NotRequired[dict[str, str]]
    ended: NotRequired[str]
    mission: NotRequired[str]
    events: NotRequired[str]
    truth: NotRequired[str]
    flown: NotRequired[int]
    listed: NotRequired[int]


# ---- gates simulate ----


class GatesSimulateRecord(TypedDict):
    out: str
    count: int
    engine: str
    truth: Annotated[dict[str, Any], Doc("the model that flew the burns, as in gates history")]
    weaker: Annotated[Number, Doc("share by which the last burns are short")]
    last: int


class DemoRecord(TypedDict):
    tables: Any
    cover: dict[str, Any]
    mission: dict[str, Any]
    out: str


# ---- trend and report ----


class ValueRowRecord(TypedDict):
    event: str
    date: str
    value: Number
    sigma: Number


class NewestRecord(TypedDict):
    value: Number
    expected: Number
    low_95: Number
    high_95: Number
    p_value: Number
    p_value_all_figures: Number
    detectable_percent: Number
    power: dict[str, Number]


class ChangePointRecord(TypedDict):
    after_event: str
    percent: Number
    p_value: Number
    log_likelihood_over_slope: Number


class FigureRecord(TypedDict):
    figure: str
    basis: str
    unit: str
    rows: list[ValueRowRecord]
    doubted_rows: Annotated[list[ValueRowRecord], Doc("shown, not judged: a suspect or void doubt concerns them")]
    change_percent: Number
    change_percent_ci95: Interval | None
    p_value: Number
    p_value_all_figures: Annotated[Number, Doc("adjusted for testing all figures")]
    slope_per_year: Number
    slope_per_year_ci95: Interval | None
    scatter: Number
    detectable_percent: Number
    power: Annotated[dict[str, Number] | None, Doc("by size of the change: 10_percent, 25_percent, 50_percent")]
    change_point: ChangePointRecord | None
    limit: Number
    limit_from: str | None
    limit_expected: str | None
    newest: NewestRecord | None
    verdict: Annotated[str, Doc("pass, watch or alarm")]
    reasons: list[str]


class PairRecord(TypedDict):
    cold: str
    warm: str
    rest_days: Number


class EquivalenceRecord(TypedDict):
    figure: str
    difference_percent: Number
    difference_percent_ci90: Interval
    margin_percent: Number
    p_value: Number
    equivalent: bool
    provable_percent: Number
    pairs: int


class CurveDistancesRecord(TypedDict):
    pairs: Numbers
    others: Numbers
    p_value: Number


class ShapeRecord(TypedDict):
    distance: Number
    usual_distance: Number
    p_value: Number
    p_value_all_figures: Number


class CyclesRecord(TypedDict):
    used: Number
    allowed: int | None


class TrendShowRecord(FigureRecord):
    """The first figure's keys at the top; all in ``figures`` where no one figure was named."""

    craft: str
    kind: str
    figures: NotRequired[list[FigureRecord]]


class TrendWatchRecord(TypedDict):
    craft: str
    kind: str
    event: str
    verdict: str
    reasons: list[str]
    figures: list[FigureRecord]
    shape: ShapeRecord | None
    cycles: CyclesRecord


class TrendCompareRecord(TypedDict):
    """Cold against warm: pairs, equivalence, curves; two events: first, second, figures, curve_distance."""

    craft: str
    kind: str
    cold_after_days: NotRequired[Number]
    warm_within_days: NotRequired[Number]
    pairs: NotRequired[list[PairRecord]]
    equivalence: NotRequired[list[EquivalenceRecord]]
    curves: NotRequired[CurveDistancesRecord | None]
    first: NotRequired[str]
    second: NotRequired[str]
    figures: NotRequired[list[dict[str, Any]]]
    curve_distance: NotRequired[Number]


class AddedRecord(TypedDict):
    event: str
    kind: str
    date: str
    revision: int | None
    figures: int
    doubts: list[str]
    doubts_detail: list[DoubtRecord]


class TrendAddRecord(TypedDict):
    store: str
    craft: str
    added: list[AddedRecord]


class ListedRecord(AddedRecord):
    motor: str | None
    days_since_last: int | None
    figure: NotRequired[str]
    value: NotRequired[Number]


class TrendListRecord(TypedDict):
    craft: str
    events: list[ListedRecord]
    cycles_used: Number


class KindOfEntryRecord(TypedDict):
    craft: str
    kind: str
    verdict: str
    reasons: list[str]
    newest_event: str
    events: list[dict[str, Any]]
    figures: list[FigureRecord]
    shape: ShapeRecord | None
    cold_warm: dict[str, Any]
    cycles: CyclesRecord
    doubts: list[str]
    doubts_detail: list[DoubtRecord]


class ReportRecord(TypedDict):
    verdict: str
    reasons: list[str]
    kinds: list[KindOfEntryRecord]
