import numpy as np
import pytest
from scipy.signal import find_peaks

from asflown.kit.peaks import peaks


@pytest.mark.parametrize("seed", range(8))
def test_published_peaks_are_scipys(seed):
    rng = np.random.default_rng(seed)
    x = (
        rng.normal(0, 1, 400).cumsum() if seed % 2 else rng.integers(-4, 5, 400).astype(float)
    )  # flat tops and equal heights
    for height, prominence, distance in ((0.0, 1.0, 1), (1.0, 3.0, 1), (0.0, 2.0, 7)):
        if seed % 2 == 0 and distance > 1:
            continue  # which of two equal ones stays is nobody's concern
        found = peaks(x, height=height, prominence=prominence, distance=distance)
        assert found.tolist() == find_peaks(x, height=height, prominence=prominence, distance=distance)[0].tolist()


def test_law_a_curve_without_a_top_has_no_peak():
    for x in (np.arange(5.0), np.zeros(5), np.array([1.0])):
        assert len(peaks(x, height=0.0, prominence=0.0)) == 0
