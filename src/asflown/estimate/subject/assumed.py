"""Sizes assumed where nothing tells them, each with its source."""

from __future__ import annotations

#: Assumed one sigma of what is taken as known: spin inertia and inertia as a share (001: 0.161 for 0.16138; its 1 %),
#: gyro bias [rad/s], and the turn of an Earth-pointed craft at Saturn, where nothing is told [rad/s].  Gyros tell a turn
#: that is three times their bias; a smaller one they would only make up.
SPIN_SHARE, INERTIA_SHARE, GYRO_BIAS, UNTOLD_TURN = 0.0024, 0.01, 5e-7, 2.2e-8
