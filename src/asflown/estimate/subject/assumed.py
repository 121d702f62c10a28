"""Sizes assumed where nothing tells them, each with its source: one sigma of what is taken as known."""

from __future__ import annotations

#: Of a wheel's spin inertia, as a share: its rounding (Feldman & Lee 2006: 0.161 for 0.16138 kg m2).
SPIN_SHARE = 0.0024
#: Of the inertia, as a share: tensors estimated in flight differ from the ground's by 0.2 to 1.3 % (the same, Table 1, Ixx and Iyy).
INERTIA_SHARE = 0.01
#: Of a gyro's bias: assumed.  Gyros tell a turn that is three times this; a smaller one they would only make up. [rad/s]
GYRO_BIAS = 5e-7
#: Of the turn of a craft of which nothing tells it: that of an Earth-pointed one at Saturn. [rad/s]
UNTOLD_TURN = 2.2e-8
