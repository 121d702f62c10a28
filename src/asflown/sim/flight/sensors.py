"""What the instruments add to the truth: one noise table, and one random stream for each sensor."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ...kit.errors import BadInput

if TYPE_CHECKING:
    from ..scenario import Scenario


@dataclass(frozen=True)
class Noise:
    """One sigma of everything.  ``NOISE`` holds the published levels."""

    attitude_white_rad: float  # read-out of attitude and attitude error; telemetry only
    attitude_coloured_rad: float  # error of the on-board estimate, which the controller flies on
    attitude_time_s: float  # its correlation time: covariance sigma^2 exp(-lag / time)
    gyro_rad_s: float  # white, on every rate sample
    wheel_rad_s: float  # white, on every tachometer reading

    def scaled(self, factor: float) -> Noise:
        return Noise(
            factor * self.attitude_white_rad,
            factor * self.attitude_coloured_rad,
            self.attitude_time_s,
            factor * self.gyro_rad_s,
            factor * self.wheel_rad_s,
        )


_NOMINAL = Noise(5e-6, 8e-6, 15.0, 2e-6, 0.005)
FACTOR = {"none": 0.0, "half": 0.5, "nominal": 1.0, "double": 2.0}
NOISE = {name: _NOMINAL.scaled(factor) for name, factor in FACTOR.items()}


def noise_of(scenario: Scenario) -> Noise:
    """The house's own levels, but for those that the scenario's [sensors] give, times what its noise says."""
    s = scenario.sensors
    own = {
        "attitude_white_rad": s.attitude_white, "attitude_coloured_rad": s.attitude_coloured,
        "attitude_time_s": s.attitude_time, "gyro_rad_s": s.gyro, "wheel_rad_s": s.wheel_rate,
    }  # fmt: skip
    return replace(_NOMINAL, **{k: v for k, v in own.items() if v is not None}).scaled(FACTOR[scenario.noise])


STAR_TRACKER_PERIOD_S = 1.0


def stream(seed: int, sensor: str) -> np.random.Generator:
    """The random numbers of one sensor.  They depend on the seed and its name only: another sensor
    more or less changes nothing."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(sensor.encode()),)))


def normal(seed: int, sensor: str, shape, sigma: float) -> np.ndarray:
    return sigma * stream(seed, sensor).standard_normal(shape)


@dataclass(frozen=True)
class Estimator:
    """A fixed-gain attitude filter, one axis like another: gyro between star tracker readings."""

    gain: float
    star_tracker_rad: float

    @classmethod
    def giving(cls, noise: Noise, period_s: float) -> Estimator:
        """Gain and star tracker noise for which the error has the stated sigma and correlation time.

        One reading to the next the error goes as x' = (1 - k)(x + g) + k v, with g the gyro's random
        walk in between: k = 1 - exp(-T / time) sets the correlation, and the variance
        s^2 (1 - (1 - k)^2) = k^2 var(v) + (1 - k)^2 var(g) the star tracker's noise v.  Raises BadInput where the gyro alone
        makes a larger error."""
        keep = np.exp(-STAR_TRACKER_PERIOD_S / noise.attitude_time_s)
        walk = noise.gyro_rad_s**2 * period_s * STAR_TRACKER_PERIOD_S
        variance = noise.attitude_coloured_rad**2 * (1 - keep**2) - keep**2 * walk
        if variance < 0:
            least = np.sqrt(keep**2 * walk / (1 - keep**2))
            raise BadInput(
                f"the gyro's noise alone makes an attitude error of {1e6 * least:.3g} urad, more than attitude_coloured",
                remedy="Raise attitude_coloured under [sensors], or lower attitude_time or gyro.",
            )
        return cls(float(1 - keep), float(np.sqrt(variance) / (1 - keep)))
