"""Light below a forest, against measurement."""

from pathlib import Path

import numpy as np
import pytest
from forest_stand import predict_light, read_stand, repeat_stand
from scipy.stats import spearmanr

PLOT = Path(__file__).parents[1] / "data" / "trees" / "Cloture20.inv.gz"


def test_copies_of_a_stand_keep_its_density():
    stand = read_stand(PLOT)
    density = len(stand.trees) / stand.zone.area
    trees = repeat_stand(stand)
    middle = stand.sensors[:, 1:3].mean(axis=0)
    away = np.linalg.norm(trees[:, 2:4] - middle, axis=1)
    assert (len(stand.trees), len(stand.sensors)) == (112, 16)
    assert (away < 120).sum() / (np.pi * 120**2) == pytest.approx(density, rel=0.1)


@pytest.mark.slow
@pytest.mark.once
def test_light_below_a_measured_forest():
    """Means of total, diffuse and direct light within 0.05 of the measured ones; places in the shade are those."""
    stand = read_stand(PLOT)
    predicted, measured = predict_light(stand, samples=1024, suns="days:12"), stand.sensors[:, 4:7]
    assert np.abs(predicted.mean(axis=0) - measured.mean(axis=0)).max() < 0.05
    ranks = [spearmanr(one, other).statistic for one, other in zip(predicted.T, measured.T, strict=True)]
    assert min(ranks) > 0.3
