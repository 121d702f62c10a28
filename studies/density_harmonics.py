"""How far the density along a low orbit is from a sine: amplitudes of its harmonics by NRLMSIS, as shares of the mean.

Run: python studies/density_harmonics.py.   Answer, 2026-11, 200 circular orbits of 420 to 650 km (rms of one component; the first is
amplitude over root two): printed below; hence _HARMONICS in estimate/sources/gather.py.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from asflown.dynamics.orbit import MU_EARTH
from asflown.dynamics.thermosphere import density_at

rng = np.random.default_rng(5)
found = []
for _ in range(200):
    r = 6.378e6 + rng.uniform(420e3, 650e3)
    u = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    turn = Rotation.from_euler("ZX", [rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(45, 100))])
    position = r * turn.apply(np.stack([np.cos(u), np.sin(u), 0 * u], axis=1))
    t = rng.uniform(7.5e8, 8.5e8) + u * np.sqrt(r**3 / MU_EARTH)
    level = rng.uniform(70, 220)
    rho = density_at(position, t, level, level, rng.uniform(3, 30))
    c = np.fft.rfft(rho) / len(rho)
    found.append(2 * np.abs(c[1:6]) / c[0].real)
size = np.array(found)
print("harmonic", *range(1, 6))
print("rms of a component", np.round(np.sqrt(np.mean(size**2, axis=0) / 2), 3))
print("largest amplitude", np.round(size.max(axis=0), 3))
