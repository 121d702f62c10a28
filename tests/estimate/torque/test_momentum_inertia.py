"""The momentum method's band where the inertia is known only so well: slews of a craft whose tensor is drawn."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from asflown.craft.model import MassProperties
from asflown.estimate.torque import torque
from asflown.estimate.torque.momentum import inertia_variance
from flights import CASSINI, telemetry_of

PREDICTED = np.array([[7400.0, -160.0, -10.0], [-160.0, 6100.0, 150.0], [-10.0, 150.0, 3700.0]])


def off_by(share: float, rng) -> np.ndarray:
    """A tensor whose moment about any axis is off by one sigma of that share."""
    L = np.linalg.cholesky(PREDICTED)
    E = share * rng.standard_normal((3, 3))
    return L @ (np.eye(3) + 0.5 * (E + E.T)) @ L.T


def slewed(I_B, rng):
    """Two slews about skew axes, no torque at all; sampled with noise.  Also the instants within a slew."""
    t = np.arange(0.0, 900.0, 1.0)
    axes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    shape = [np.exp(-(((t - at) / 45) ** 2)) for at in (250.0, 600.0)]
    omega = 2e-3 * (np.outer(shape[0], axes[0]) + np.outer(shape[1], axes[1]))
    turned = Rotation.identity()
    H, at_rest = np.empty((len(t), 3)), 8.0 * rng.standard_normal(3)
    for k, w in enumerate(omega):
        H[k] = turned.inv().apply(at_rest)
        middle = w if k + 1 == len(t) else 0.5 * (w + omega[k + 1])
        turned = turned * Rotation.from_rotvec(middle)
    wheels = [w for w in CASSINI.wheels if w.name in ("RWA1", "RWA2", "RWA4")]
    spins = np.array([w.spin_inertia * np.array(w.axis) for w in wheels])
    rates = np.linalg.solve(spins.T, (H - omega @ I_B).T).T
    channels = {
        f"wheel_rate_{w.name}": (t[::2], (rates[:, k] + 0.003 * rng.standard_normal(len(t)))[::2])
        for k, w in enumerate(wheels)
    }
    channels |= {f"body_rate_{a}": (t, omega[:, j] + 2e-7 * rng.standard_normal(len(t))) for j, a in enumerate("xyz")}
    return telemetry_of(**channels)


def predicted(share: float):
    e = PREDICTED
    entry = MassProperties.model_construct(
        date=0, piece="flight", inertia=(e[0, 0], e[1, 1], e[2, 2], e[0, 1], e[0, 2], e[1, 2]),
        inertia_per_spin_inertia=None, basis="predicted", sigma=share, mass=None, source="", doubt="",
    )  # fmt: skip
    return CASSINI.model_copy(update={"mass_properties": (entry,)})


@pytest.mark.parametrize("share", [0.05, 0.01])
def test_recovery_the_band_holds_the_truth_in_slews_with_a_predicted_inertia(share):
    inside, plain = [], []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        result = torque(slewed(off_by(share, rng), rng), predicted(share), method="momentum")
        slewing = (np.abs(result.time_s - 250) < 60) | (np.abs(result.time_s - 600) < 60)
        off = np.abs(result.torque_Nm[slewing])
        inside.append(np.mean(off <= 1.96 * result.torque_sigma_Nm[slewing]))
        quiet = np.median(result.torque_sigma_Nm[~slewing], axis=0)
        plain.append(np.mean(off <= 1.96 * quiet))
    assert 0.90 <= np.mean(inside) <= 0.99
    assert np.mean(plain) < 0.5  # the band of noise alone


def test_law_the_moment_about_any_axis_is_off_by_the_share():
    """About a principal axis of any tensor a pure acceleration leaves share times I alpha."""
    axes = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    tensor = axes @ np.diag([10.0, 12.0, 15.0]) @ axes.T
    for moment, axis in zip((10.0, 12.0, 15.0), axes.T, strict=True):
        rng = np.random.default_rng(2)
        variance = inertia_variance(tensor, 0.05, np.zeros((1, 3)), axis[None, :])[0]
        L = np.linalg.cholesky(tensor)
        drawn = []
        for _ in range(4000):
            E = 0.05 * rng.standard_normal((3, 3))
            drawn.append(L @ (0.5 * (E + E.T)) @ L.T @ axis)
        assert np.allclose(np.var(drawn, axis=0), variance, rtol=0.15, atol=0.02 * (0.05 * moment) ** 2)
        assert np.std(np.array(drawn) @ axis) == pytest.approx(0.05 * moment, rel=0.05)
