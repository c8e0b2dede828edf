"""Gather and forward on real cities: facades by orientation and roofs, first light and reflected
light apart.

Roofs that lie alone and those that share a place with another face, as more than half of
Manhattan's do, make a group each.

With CITYPV_WHOLE_CITIES=1 the cities are not cut to their middle (some minutes each), and the table
is printed (-s).
"""

import os

import numpy as np
import pandas as pd
import pytest
from real_cities import SUNS, city_and_alone
from scenes import run_forward, run_gather
from test_closed_forms import direct_relative
from test_tracing import three_houses

SAMPLES = 256  # of gather
PHOTONS = {"Berlin": 32, "Manhattan": 12}  # per patch of the whole city
WHOLE = os.environ.get("CITYPV_WHOLE_CITIES") == "1"
RUNS = 6  # of forward
PARTS = ("sky", "suns", "reflected sky", "reflected suns")
ERRORS = 4.0
BIAS = 0.005  # of the reflected part
# what reaches them is little and comes from near by, where light is uneven within cells
BIAS_ON_ROOFS = 0.015
SMALLEST_SHARE = 0.05  # of the area: smaller groups say little

pytestmark = pytest.mark.slow


def groups_of(surfaces, alone):
    """Names and members of the groups: quarters of the facades' azimuths; roofs that lie alone, and
    others.
    """
    quarter = np.round(surfaces.surface_azimuth / 90).astype(int) % 4
    groups = {
        f"facade {side}": (surfaces.kind == "facade") & (quarter == number)
        for number, side in enumerate(("north", "east", "south", "west"))
    }
    roof = np.isin(surfaces.kind, ("flat", "roof", "steep"))
    groups |= {"roof": roof & alone, "shared roof": roof & ~alone}
    whole = sum(surfaces.area[members].sum() for members in groups.values())
    return {
        name: members
        for name, members in groups.items()
        if surfaces.area[members].sum() > SMALLEST_SHARE * whole
    }


def group_means(name, groups, estimator, seed, samples):
    """Means over each group: (g, 4), first light of sky and suns, and what reflections add
    to them.
    """
    scene = city(name)[0]
    if estimator == "gather":
        first, whole = light_of(run_gather(scene, SUNS, seed=seed, samples=samples, report="all"))
    else:
        # The same photons without and with reflections: in their difference the noise of the first
        # hits drops out.
        settings = {"seed": seed, "samples": samples, "report": "all"}
        first, whole = (
            light_of(run_forward(scene, SUNS, max_bounces=n, **settings))[1] for n in (0, 3)
        )
    light, area = np.hstack([first, whole - first]), scene.surfaces.area
    return np.array(
        [np.average(light[members], axis=0, weights=area[members]) for members in groups.values()]
    )


def light_of(transfer):
    """Light of the sky and the suns before any reflection, which only gather tells apart, and all
    light: two (n, 2).
    """
    cosine = np.maximum(transfer.surfaces.normal @ SUNS.direction.T, 0)
    first = np.stack(
        [transfer.sky_view_factor, (cosine * transfer.visible_share) @ SUNS.weight], axis=1
    )
    return first, np.stack(
        [transfer.diffuse_relative, direct_relative(transfer) @ SUNS.weight], axis=1
    )


def city(name):
    return city_and_alone(name, WHOLE)


def error_of_mean(runs, areas):
    """Standard error of the mean of independent runs: (g, 4).

    Light counted by photons, or rays, has a variance in proportion to light over area. How many
    times that it is, all groups tell together: a few runs would tell it badly for each group alone.

    Parameters
    ----------
    runs : (k, g, 4) float
    areas : (g,) float
    """
    shape = runs.mean(axis=0) / areas[:, None]
    scale = (runs.var(axis=0, ddof=1) / shape).mean(axis=0)
    return np.sqrt(scale * shape / len(runs))


def compare_estimators(name, groups, gather, forward):
    """Runs of both estimators, each with its samples and number of seeds: a table with a row for
    each group and part, of the mean of gather, gather less forward, and the standard error of that.
    """
    by_gather = np.array(
        [group_means(name, groups, "gather", seed, gather[0]) for seed in range(gather[1])]
    )
    by_forward = np.array(
        [group_means(name, groups, "forward", 100 + seed, forward[0]) for seed in range(forward[1])]
    )
    areas = np.array([city(name)[0].surfaces.area[members].sum() for members in groups.values()])
    error = np.hypot(error_of_mean(by_gather, areas), error_of_mean(by_forward, areas))
    mean = by_gather.mean(axis=0)
    columns = {
        "mean": mean.ravel(),
        "difference": (mean - by_forward.mean(axis=0)).ravel(),
        "error": error.ravel(),
    }
    return pd.DataFrame(
        columns, pd.MultiIndex.from_product([groups, PARTS], names=["group", "part"])
    ).reset_index()


def test_first_light_of_gather_is_that_of_a_run_without_reflections():
    settings = {"samples": 64, "report": "all"}
    none, whole = (
        run_gather(three_houses(), SUNS, max_bounces=bounces, **settings) for bounces in (0, 3)
    )
    (first, every), (_, alone) = light_of(whole), light_of(none)
    np.testing.assert_allclose(first, alone, rtol=1e-12)
    assert (every > 1.01 * alone).sum() > 10


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["Berlin", "Manhattan"])
def test_gather_is_forward(name):
    scene, alone = city(name)
    groups = groups_of(scene.surfaces, alone)
    samples = 64 if WHOLE and len(scene.triangles) > 3e5 else SAMPLES
    found = compare_estimators(name, groups, (samples, 2), (PHOTONS[name] if WHOLE else 56, RUNS))
    print(f"\n{name}, {len(scene.triangles)} patches\n{found.to_string()}")
    reflected, roof = found.part.str.startswith("reflected"), found.group.str.contains("roof")
    bias = np.where(roof, BIAS_ON_ROOFS, BIAS)
    allowed, share = (
        ERRORS * found.error + bias * found["mean"] * reflected,
        found.error / found["mean"],
    )
    assert "roof" in groups and ("shared roof" in groups or name == "Berlin")
    # It says something: what light that is even over patches of ten metres changes, 1 to 1.8 %,
    # shows on facades.
    assert share[reflected & ~roof].max() < 0.006
    assert share.max() < 0.012
    assert (found.difference.abs() <= allowed).all()
