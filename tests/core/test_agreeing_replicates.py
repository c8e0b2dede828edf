"""Replicates that agree by chance state no error of 0: a roof under a thin mast that hardly any ray
meets.
"""

import numpy as np
from cities import box, make_city
from scenes import run_gather
from test_closed_forms import SUNS

from citypv.core.city.build_scene import build_scene


def roof_and_mast(*mast, seed=0):
    """A roof of 100 m² with a mast beside it, by 64 rays and 16 points of each patch: its index,
    Transfer.
    """
    polygons = [*box("house", 0, 0, 10, 10, 0, 5), *(box("mast", *mast) if mast else [])]
    transfer = run_gather(
        build_scene(make_city(polygons), latitude=50.0, longitude=10.0),
        SUNS, samples=64, shadow_samples=16, threads=1, seed=seed,
    )  # fmt: skip
    roof = (np.asarray(transfer.surfaces.kind) == "flat") & (
        np.asarray(transfer.surfaces.building_id) == "house"
    )
    return int(np.flatnonzero(roof)[0]), transfer


def test_a_mast_that_no_ray_meets_leaves_an_error():
    """All rays of the roof see the sky, which no closed form tells: at least one of them is in
    doubt.
    """
    found = [roof_and_mast(40, 40, 0.2, 0.2, 0, 8, seed=seed) for seed in range(4)]
    agree = [transfer for roof, transfer in found if transfer.sky_view_factor[roof] == 1]
    assert agree
    for roof, transfer in found:
        assert 0 < transfer.diffuse_relative_standard_error[roof] <= 1 / 64
        assert 0 < transfer.direct_annual_standard_error[roof] <= 1 / 16


def test_closed_forms_are_known_exactly():
    roof, transfer = roof_and_mast()
    assert transfer.sky_view_factor[roof] == 1
    assert (
        transfer.diffuse_relative_standard_error[roof]
        == 0
        == transfer.direct_annual_standard_error[roof]
    )
