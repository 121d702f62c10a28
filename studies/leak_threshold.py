"""How high must the leak monitor's log likelihood ratio be, for noise alone to exceed it as seldom as stated?

Innovations are drawn, not flown: noise of every size gives the same law, as long as it is white.  Many records at once, for
gains do not depend on data.  The rate an instant is -ln(1 - P)/N, P the share of records of N instants with an exceedance.

Run: python studies/leak_threshold.py.   Answer, 2026-11: ln rate = ln(h)/2 - h within 0.1 for h from 6 to 10,
from 1 to 16 s a step and 225 to 3600 instants, hence _EXPONENT in
estimate/leak/likelihood.py.
"""

import numpy as np

from asflown.craft.load import load_craft
from asflown.estimate.leak.firing import geometry_of
from asflown.estimate.leak.known import Known
from asflown.estimate.leak.likelihood import Monitor
from asflown.estimate.leak.noise import Noise
from asflown.estimate.leak.residual import Steps
from asflown.kit.doubts import Doubts

RECORDS = 1500
LEVELS = np.arange(4.0, 11.1, 1.0)


def quiet_steps(count: int, step_s: float) -> Steps:
    """A hold of Cassini in which nothing happens, the wheels at 300 rpm."""
    none = np.zeros((count, 8))
    return Steps(
        tai_ns=(np.arange(count) * step_s * 1e9).astype(np.int64),
        residual=np.zeros((count, 3)),
        turned=np.tile(np.eye(3), (count, 1, 1)),
        body_rate=np.zeros((count, 3)),
        in_wheels=np.tile(5.0 * np.eye(3), (count, 1, 1)),
        ordered=none,
        pulses=none,
        guessed=none,
        unsure=np.zeros((count, 3, 3)),
        lost=np.zeros(count, bool),
        doubts=Doubts(),
    )


def heights(count: int, step_s: float, seed: int) -> np.ndarray:
    """The largest log likelihood ratio of each record. (RECORDS,)"""
    craft = load_craft("cassini", cm=(0, 0, 1.35))
    I_B, rng = craft.at(None).inertia_kgm2, np.random.default_rng(seed)
    noise = Noise(np.array([0.0147, 0.0123, 0.0075]) ** 2, np.ones(3), np.inf, count)
    m = Monitor(geometry_of(craft), noise, I_B, 3, np.inf, Known())
    steps, d, kept, highest = quiet_steps(count, step_s), np.zeros((RECORDS, 0, 3)), m.onset, np.zeros(RECORDS)
    for i in range(count):
        m.forward(steps, i)
        _, S, _, weighted = m.gains(steps, i)
        d = np.concatenate([d, np.zeros((RECORDS, len(m.onset) - len(kept), 3))], axis=1)
        v = rng.standard_normal((RECORDS, 3)) @ np.linalg.cholesky(S).T
        d += np.einsum("mi,bij->mbj", v, weighted[:, :, :3])
        kept = m.onset
        m.measure(steps, i)
        if i:
            now = m.evidence(i)
            up = np.maximum(d @ m.geometry.columns, 0.0)
            highest = np.maximum(highest, (0.5 * up**2 / now.c[:, :8]).max(axis=(1, 2)))
        m.thin(i)
        d, kept = d[:, np.isin(kept, m.onset)], m.onset
    return highest


def main() -> None:
    print("rate an instant, by threshold; and ln rate - ln(h)/2 + h")
    print("                     " + "".join(f"{h:>11.0f}" for h in LEVELS))
    for count, step_s in ((225, 4.0), (900, 4.0), (900, 1.0), (900, 16.0), (3600, 4.0)):
        highest = heights(count, step_s, count)
        share = np.array([(highest > h).mean() for h in LEVELS])
        rate = -np.log1p(-np.minimum(share, 1 - 0.5 / RECORDS)) / count
        print(f"{count:5d} of {step_s:4.0f} s  rate  " + "".join(f"{r:11.2e}" for r in rate))
        with np.errstate(divide="ignore"):
            print(
                " " * 20 + "".join(f"{np.log(r) - np.log(h) / 2 + h:11.2f}" for r, h in zip(rate, LEVELS, strict=True)),
                flush=True,
            )


if __name__ == "__main__":
    main()
