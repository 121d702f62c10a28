"""What an estimate is about: telemetry together with the craft as it was then."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import ndimage

from ..craft.model import Craft, CraftAt, Wheel
from ..kit.errors import BadInput, some_of
from ..kit.regression import LocalFit, local_polynomial, noise_sigma
from ..kit.timeline import NS, seconds_since, utc_label
from ..telemetry.channels import AXES
from ..telemetry.telemetry import Channel, Telemetry

#: A mechanism counts as moving when its angle changes by more than this. [rad]
_MOVED = 0.05

#: A body rate that changes by more than this is that of a slew. [rad/s]
_SWING_OF_A_SLEW = 2e-4

#: Instants in one estimate: five weeks at 1 s, some gigabytes of memory.
_MOST_INSTANTS = 3_000_000


@dataclass(frozen=True)
class Subject:
    """Telemetry, the craft on its date, and the inertia that moves with the body axes."""

    telemetry: Telemetry
    craft: CraftAt
    inertia_kgm2: np.ndarray | None  # (3, 3); without a moving mechanism; per unit spin inertia if relative
    moving: str | None
    doubts: tuple[str, ...]

    @property
    def relative(self) -> bool:
        return any(w.spin_inertia is None for w in self.craft.wheels)

    def known_inertia(self) -> np.ndarray:
        """Raises BadInput where the craft's inertia is not known."""
        if self.inertia_kgm2 is None:
            raise BadInput(
                f"the inertia of {self.craft.craft.name} is not known, and this method needs it",
                remedy='Give it: --inertia "Ixx,Iyy,Izz,Ixy,Ixz,Iyz" in kg m2.',
            )
        return self.inertia_kgm2

    def controller(self):
        k = self.craft.craft.wheel_controller
        if k is None:
            raise BadInput(
                "this craft has no wheel controller, which the method needs",
                file=self.craft.craft.name,
                remedy="Describe it under [wheel_controller] in the craft file, or use --method momentum.",
            )
        return k

    def wheels(self) -> list[tuple[Channel, Wheel]]:
        """Each wheel in service with its rate channel.

        Raises BadInput for a wheel the craft does not have and for one without telemetry."""
        tlm, craft = self.telemetry, self.craft.craft
        for name in tlm.members("wheel_rate"):
            if name not in craft.wheel_names:
                raise BadInput(
                    f"{craft.name} has no wheel {name!r}",
                    file=tlm.source or None,
                    channel=f"wheel_rate_{name}",
                    remedy=f"Its wheels: {some_of(craft.wheel_names)}. Rename the column, or name the right --craft.",
                )
        missing = [w.name for w in self.craft.wheels if f"wheel_rate_{w.name}" not in tlm]
        if missing:
            raise BadInput(
                f"no rate of wheel {some_of(missing)}, so the momentum is not complete",
                file=tlm.source or None,
                channel=f"wheel_rate_{missing[0]}",
                remedy="Add the channel; a wheel out of service needs valid_to in the craft file.",
            )
        return [(tlm.channel(f"wheel_rate_{w.name}"), w) for w in self.craft.wheels]


def subject_of(telemetry: Telemetry, craft: Craft, moving: str | None = "auto") -> Subject:
    """The craft on the telemetry's date.

    ``moving``: a mechanism whose inertia is taken off (000 eqs 4, 5), None for no one, or 'auto': the
    one whose angle is seen to move.  An inertia given by the user is used as given."""
    now = craft.at(telemetry.epoch_ns if telemetry.dated else None)
    given = any(m.piece == "given" for m in craft.mass_properties)
    doubts = list(telemetry.doubts) + [d for d in now.doubts]
    if not telemetry.dated and not given and len(craft.mass_properties) > 1:
        doubts.append("the telemetry has no epoch: the craft's latest known mass properties and wheel set are used")
    for name in telemetry.members("wheel_rate"):
        if name in craft.wheel_names and now.wheel(name) is None:
            doubts.append(f"wheel {name} was not in service then ({_when(telemetry)}): its rate is not used")
    part = None if given else (_moved(telemetry, craft) if moving == "auto" else moving)
    I_B = now.inertia_kgm2
    if part is not None and I_B is not None:
        I_B = now.effective_inertia(part)
    return Subject(telemetry, now, I_B, part, tuple(dict.fromkeys(doubts)))


def _when(telemetry: Telemetry) -> str:
    return utc_label(telemetry.epoch_ns)[:10] if telemetry.dated else "latest set"


def _moved(telemetry: Telemetry, craft: Craft) -> str | None:
    for m in craft.mechanisms:
        for channel in (f"cover_angle_{m.name}", "cover_angle" if len(craft.mechanisms) == 1 else ""):
            if channel in telemetry and np.ptp(telemetry.channel(channel).usable.values) > _MOVED:
                return m.name
    return None


def slews(telemetry: Telemetry) -> bool:
    """Whether the body's rate changes as it does in a slew, never in a hold; single spikes do not count."""
    rates = [telemetry.channel(f"body_rate_{a}").usable.values for a in AXES if f"body_rate_{a}" in telemetry]
    return any(len(r) and np.ptp(ndimage.median_filter(r, 5)) > _SWING_OF_A_SLEW for r in rates)


def thrusters_firing(telemetry: Telemetry) -> list[str]:
    """Thrusters whose cumulative on-time or pulse count rises in the record."""
    channels = [c for c in telemetry.channels.values() if c.kind.stem in ("on_time", "pulse_count")]
    return list(dict.fromkeys(c.member for c in channels if (np.diff(c.usable.values) > 0).any()))


def check_on_times(telemetry: Telemetry, craft: Craft) -> None:
    """Raises BadInput where the control mode says that thrusters hold the craft, and what they did is not in the record."""
    mode = telemetry.channels.get("control_mode")
    if mode is None or "RCS" not in mode.usable.values or thrusters_firing(telemetry):
        return
    first = craft.thrusters[0].name if craft.thrusters else "<THRUSTER>"
    raise BadInput(
        "thrusters hold the craft in this record, and how long each fired is not in it: their torque cannot be told from the surroundings'",
        file=telemetry.source or None,
        channel=f"on_time_{first}",
        remedy=f"Add on_time_{first} and those of the others, cumulative in seconds (and pulse_count_{first}, … where they are known).",
    )


def gaps_on_grid(channel: Channel, grid: Grid) -> list[tuple[float, float]]:
    """Gaps of a channel, from the grid's start. [s]"""
    c = channel.usable
    t = grid.of(c.tai_ns)
    return [(float(t[a.stop - 1]), float(t[b.start])) for a, b in pairwise(c.segments())]


@dataclass(frozen=True)
class Grid:
    """Evenly spaced instants (int64 ns TAI) at which an estimate is given."""

    start_ns: int
    step_s: float
    count: int

    @property
    def seconds(self) -> np.ndarray:
        """From the grid's own start."""
        return self.step_s * np.arange(self.count)

    def of(self, tai_ns) -> np.ndarray:
        """Instants as seconds from the grid's start."""
        return seconds_since(tai_ns, self.start_ns)

    def from_epoch(self, telemetry: Telemetry) -> np.ndarray:
        return float(telemetry.seconds(self.start_ns)) + self.seconds


def grid_for(channels: list[Channel], step_s: float | None = None) -> Grid:
    """From the first to the last instant that all ``channels`` cover.

    The step is 1 s, or a quarter of the coarsest cadence where that is longer than 4 s."""
    usable = [c.usable for c in channels]
    for c in usable:
        if len(c.tai_ns) < 2:
            raise BadInput(
                f"too few usable samples ({len(c.tai_ns)})",
                channel=c.name,
                remedy="Take a longer window, or check what was excluded (asflown telemetry check).",
            )
    start, stop = max(int(c.tai_ns[0]) for c in usable), min(int(c.tai_ns[-1]) for c in usable)
    if step_s is None:
        coarsest = max(c.cadence_ns for c in usable) / NS
        step_s = 1.0 if coarsest <= 4.0 * (1 + 1e-9) else coarsest / 4
    if stop <= start:
        raise BadInput(
            f"{some_of(c.name for c in channels)} have no time in common",
            remedy="These channels must overlap in time.",
        )
    count = int(np.floor((stop - start) / NS / step_s + 1e-9)) + 1
    if count > _MOST_INSTANTS:
        raise BadInput(
            f"the record spans {(stop - start) / NS / 86_400:,.0f} days, {count:,} instants of {step_s:g} s: too many for one estimate",
            channel=usable[0].name,
            remedy="Give a window (--start, --stop). If the record is not that long, one time stamp is wrong "
            "(asflown telemetry check shows the gap).",
        )
    return Grid(start, step_s, count)


@dataclass(frozen=True)
class SampledFit:
    """Local fits of one channel on a grid; NaN outside its gap-free stretches.

    ``sigma``: one sample's independent noise; ``widened``: (M, 3), variance of value, slope and
    curvature that a window stretched over missing samples adds; ``gaps``: from the grid's start [s]."""

    fit: LocalFit
    sigma: float
    widened: np.ndarray
    gaps: tuple[tuple[float, float], ...]

    def variance(self, weights) -> np.ndarray:
        """Of w0 value + w1 slope + w2 curvature. (M,)"""
        return self.fit.variance(weights) * self.sigma**2 + self.widened @ np.square(weights)


def fit_on_grid(channel: Channel, grid: Grid, *, degree: int, half_width_s: float) -> SampledFit:
    """Local polynomials through each gap-free stretch of a channel.

    Runs of up to five missing samples are bridged: the window widens, and so does the variance.
    Raises BadInput where no stretch is as long as the window."""
    c = channel.usable
    t = grid.of(c.tai_ns)
    at = grid.seconds
    derivatives = np.full((3, grid.count), np.nan)
    gain = np.full((grid.count, 3, 3), np.nan)
    width, own = np.full(grid.count, np.nan), np.zeros(grid.count)
    widened, shortfall = np.zeros((grid.count, 3)), np.zeros((grid.count, 3))
    stretches = c.segments()
    longest = max((t[s][-1] - t[s][0] for s in stretches), default=0.0)
    held = [
        s for s in stretches if s.stop - s.start >= degree + 3 and t[s][-1] - t[s][0] >= 2 * half_width_s * (1 - 1e-9)
    ]
    if not held:
        raise BadInput(
            f"the longest stretch without a gap is {longest:.0f} s, shorter than the window of {2 * half_width_s:.0f} s",
            channel=channel.name,
            remedy="Take a longer record, or a shorter window (--window).",
        )
    noises, weights = [], []
    for s in held:
        inside = (at >= t[s][0] - 1e-9) & (at <= t[s][-1] + 1e-9)
        part = local_polynomial(t[s], c.values[s], at[inside], degree=degree, half_width=half_width_s)
        derivatives[:, inside], gain[inside], width[inside] = part.derivatives, part.gain, part.half_width
        widened[inside], shortfall[inside] = _cost_of_widening(
            t[s], c.values[s], at[inside], part, degree, half_width_s
        )
        noise = noise_sigma(t[s], c.values[s], degree=degree, half_width=half_width_s)
        if np.isfinite(noise):
            noises.append(noise)
            weights.append(s.stop - s.start)
    sigma = float(np.average(noises, weights=weights)) if noises else float("nan")
    sigma = max(sigma, channel.count_size / np.sqrt(12)) if np.isfinite(sigma) else sigma
    edges = [t[0], *[v for s in held for v in (t[s][0], t[s][-1])], t[-1]]
    gaps = tuple((a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b > a)
    fit = LocalFit(derivatives, np.arange(grid.count), gain, width, own)
    return SampledFit(fit, sigma, widened + shortfall * sigma**2, gaps)


def _cost_of_widening(t, y, at, part: LocalFit, degree: int, half_width_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Variance to add where a window had to widen over missing samples: (m, 3), and (m, 3) per unit noise variance.

    What the wider window changes elsewhere in this record is what it may hide here: the mean square
    difference of both windows' answers over the parts where the narrow one fits.  A longer base also
    makes a slope less noisy; the second return takes that credit back, so that a hole never narrows the
    band."""
    cost, shortfall = np.zeros((len(at), 3)), np.zeros((len(at), 3))
    usual = float(np.median(part.half_width))
    inner = (at > t[0] + half_width_s) & (at < t[-1] - half_width_s)  # an end's variance says enough
    stretched = inner & (part.half_width > 1.01 * usual)
    intact = inner & ~stretched
    if not stretched.any() or intact.sum() < 10:
        return cost, shortfall
    diagonal = np.einsum("mii->mi", part.gain)
    shortfall[stretched] = np.maximum(diagonal[intact].max(axis=0) - diagonal[stretched], 0)
    levels = np.linspace(usual, part.half_width[stretched].max(), 4)[1:]
    level = np.minimum(np.searchsorted(levels, part.half_width - 1e-9), 2)
    for k, wide in enumerate(levels):
        here = stretched & (level == k)
        if here.any():
            other = local_polynomial(t, y, at[intact], degree=degree, half_width=wide)
            cost[here] = np.mean((other.derivatives - part.derivatives[:, intact]) ** 2, axis=1)
    return cost, shortfall
