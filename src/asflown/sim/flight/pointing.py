"""Where an orbiting craft is commanded to point: along the orbit, at a place on the Earth, at rest in space, and from one to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...dynamics.frames import earth_fixed
from ...kit.errors import BadInput
from ...kit.rotations import lvlh_to_inertial, quaternion

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..scenario import Pointing
    from .world import Along

    #: Attitudes, body to inertial, at instants (M,).
    Attitude = Callable[[np.ndarray], scipy.spatial.transform.Rotation]

#: Rates and accelerations are differences of attitudes this far apart: 1e-11 rad/s of truncation, 1e-13 rad/s2 of rounding. [s]
_APART_S = 0.1
#: Equatorial radius and flattening of the Earth's ellipsoid (WGS84). [m]
_RADIUS_M, _FLATTENING = 6_378_137.0, 1 / 298.257223563


def pointed_motion(pointings: tuple[Pointing, ...], along: Along | None, times: np.ndarray):
    """Attitude (N, 4), body to inertial, rate (N, 3) [rad/s] and acceleration (N, 3) [rad/s2], body axes.

    Raises BadInput where one pointing starts before the turn to the one before has ended."""
    attitude = _sequence(pointings, along)
    before, here, after = (attitude(times + by) for by in (-_APART_S, 0.0, _APART_S))
    came, goes = (before.inv() * here).as_rotvec() / _APART_S, (here.inv() * after).as_rotvec() / _APART_S
    q = quaternion(here)
    # q and -q are one attitude: no jumps from one to the other
    turned = np.concatenate([[1.0], np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1.0, 1.0)])
    return q * np.cumprod(turned)[:, None], (came + goes) / 2, (goes - came) / _APART_S


def _sequence(pointings: tuple[Pointing, ...], along: Along | None) -> Attitude:
    attitude, ends = None, -np.inf
    for p in pointings:
        if attitude is not None and p.start < ends:
            raise BadInput(
                f"the pointing at {p.start:g} s starts before the craft has turned to the last one, at {ends:g} s",
                remedy="Start it later, or give the one before less time to turn.",
            )
        next_one = _held(p, along, attitude)
        attitude = next_one if attitude is None else _turning(attitude, next_one, p)
        ends = p.start + p.turn
    assert attitude is not None
    return attitude


def _turning(old: Attitude, new: Attitude, p: Pointing) -> Attitude:
    """From the old one to the new about the axis between them, which both carry on: rate and acceleration stay continuous."""

    def attitude(t):
        x = np.clip((t - p.start) / p.turn, 0, 1)
        share = x**3 * (10 - 15 * x + 6 * x**2)
        begin = old(t)
        return begin * scipy.spatial.transform.Rotation.from_rotvec(share[:, None] * (begin.inv() * new(t)).as_rotvec())

    return attitude


def _held(p: Pointing, along: Along | None, before: Attitude | None) -> Attitude:
    """One pointing alone, as if it had always been commanded."""
    turn = scipy.spatial.transform.Rotation.from_rotvec(p.attitude or (0.0, 0.0, 0.0))
    if p.frame == "inertial":
        if p.attitude is None and before is not None:
            turn = before(np.array([p.start]))[0]
        return lambda t: scipy.spatial.transform.Rotation.from_quat(np.tile(turn.as_quat(), (len(t), 1)))
    if along is None:
        raise BadInput("a pointing along the orbit needs an orbit", remedy="Give the scenario an [orbit].")
    if p.frame == "lvlh":
        return lambda t: _along_track(along, t) * turn
    return lambda t: _at_place(p, along, t) * turn


def _along_track(along: Along, t) -> scipy.spatial.transform.Rotation:
    state = along.place(t)
    return lvlh_to_inertial(state[:, :3], state[:, 3:])


def _at_place(p: Pointing, along: Along, t) -> scipy.spatial.transform.Rotation:
    """z towards the place; y as near against the orbit normal as it can be."""
    state = along.place(t)
    to_earth = earth_fixed(along.epoch_tai_s + t)
    place = np.einsum("nji,j->ni", to_earth, _on_ellipsoid(p))
    z = place - state[:, :3]
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross(-np.cross(state[:, :3], state[:, 3:]), z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return scipy.spatial.transform.Rotation.from_matrix(np.stack([x, np.cross(z, x), z], axis=2))


def _on_ellipsoid(p: Pointing) -> np.ndarray:
    """Earth-fixed place of geodetic latitude, longitude and height. (3,) [m]"""
    e2, latitude, longitude = _FLATTENING * (2 - _FLATTENING), p.latitude or 0.0, p.longitude or 0.0
    sine, cosine = np.sin(latitude), np.cos(latitude)
    N = _RADIUS_M / np.sqrt(1 - e2 * sine**2)
    across = (N + p.height) * cosine
    return np.array([across * np.cos(longitude), across * np.sin(longitude), (N * (1 - e2) + p.height) * sine])
