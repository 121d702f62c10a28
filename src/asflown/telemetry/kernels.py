"""A trajectory from SPICE kernels, where the user has them and spiceypy is installed (``pip install asflown[spice]``)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..kit.errors import BadInput, some_of
from ..kit.files import sha256_of
from ..kit.timeline import NS, et_to_tai_ns
from .trajectory import TrajectoryTable

if TYPE_CHECKING:
    from collections.abc import Sequence

#: How far on either side of closest approach, and how often. [s]
REACH_S, STEP_S = 660.0, 5.0


def trajectory_from_kernels(kernels: Sequence[str | Path], target: str, body: str, closest_ns: int) -> TrajectoryTable:
    """Geometric state of ``target`` from ``body``'s centre in the axes IAU_<body>, around an instant (ns TAI).

    ``kernels``: a metakernel, or an SPK of craft and body with a PCK of the body's axes.
    Raises BadInput without spiceypy, for a kernel that cannot be read, and where they do not hold what is asked."""
    try:
        import spiceypy
    except ImportError:
        raise BadInput(
            "kernels need spiceypy, which is not installed",
            remedy="Run: pip install 'asflown[spice]'; or write the trajectory as a table (--trajectory).",
        ) from None
    names = [str(k) for k in kernels]
    for name in names:
        if not Path(name).is_file():
            raise BadInput("this kernel does not exist", file=name, remedy="Check the path.")
    tai_ns = closest_ns + np.round(np.arange(-REACH_S, REACH_S + STEP_S, STEP_S) * NS).astype(np.int64)
    et = (tai_ns - int(et_to_tai_ns(0.0)[0])) / NS
    et = et - (et_to_tai_ns(et) - tai_ns) / NS  # TDB - TAI varies by up to 2 ms
    try:
        for name in names:
            spiceypy.furnsh(name)
        states = np.array(
            [spiceypy.spkezr(target, float(s), f"IAU_{body.upper()}", "NONE", body.upper())[0] for s in et]
        )
    except spiceypy.exceptions.SpiceyError as why:
        short = str(getattr(why, "short", "")) or type(why).__name__
        raise BadInput(
            f"the kernels do not provide {target} relative to {body} in IAU_{body.upper()}: {short}",
            file=some_of(names),
            remedy=f"They must cover {target} and {body} within {REACH_S:g} s of closest approach, and the body's axes (an SPK and a PCK, or a metakernel).",
        ) from None
    finally:
        spiceypy.kclear()
    hashes = "".join(sha256_of(Path(n).read_bytes()) for n in names)
    return TrajectoryTable(tai_ns, True, 1e3 * states[:, :3], 1e3 * states[:, 3:], sha256_of(hashes.encode()))
