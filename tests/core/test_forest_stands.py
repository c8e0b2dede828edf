"""Light below a forest, against measurement."""

from pathlib import Path

import numpy as np
import pytest
from forest_stand import predict_light, read_stand
from scipy.stats import spearmanr

PLOT = Path(__file__).parents[1] / "data" / "trees" / "Cloture20.inv.gz"


@pytest.mark.slow
def test_light_below_a_measured_forest():
    """Means of total, diffuse and direct light within 0.05 of the measured ones; places in the
    shade are those.
    """
    stand = read_stand(PLOT)
    predicted, measured = predict_light(stand, samples=1024, suns="days:12"), stand.sensors[:, 4:7]
    assert np.abs(predicted.mean(axis=0) - measured.mean(axis=0)).max() < 0.05
    ranks = [
        spearmanr(one, other).statistic for one, other in zip(predicted.T, measured.T, strict=True)
    ]
    assert min(ranks) > 0.3
