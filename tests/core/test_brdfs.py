"""Laws of reflection: samplers against published densities, white furnace, Fresnel's known
values.
"""

import numpy as np
import pytest
from scipy import stats
from thorough import mark_cases

from citypv.core.patches.brdfs import Glass, Glossy, Mirror, fresnel, reflect_interfaces
from citypv.core.rays.sample_points import cosine_direction

SPREADING = [Glossy(0.9, 0.1), Glossy(0.8, 0.3), Glossy(1.0, 1.0)]
ZENITHS = [0.0, 30.0, 60.0, 85.0]  # [°]
PAIRS = [(brdf, zenith) for k, brdf in enumerate(SPREADING) for zenith in ZENITHS[k % 2 :: 2]]


def towards(zenith, azimuth=25.0):
    """A unit vector: (1, 3)."""
    zenith, azimuth = np.radians(zenith), np.radians(azimuth)
    return np.array(
        [[np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)]]
    )


def masking(cosine, roughness):
    """Λ of Smith for GGX (Heitz 2014, Eq. 72)."""
    return (np.sqrt(1 + roughness**2 * (1 / cosine**2 - 1)) - 1) / 2


def laws(brdf, arriving, leaving):
    """Reflected radiance over irradiance, D G / (4 cos cos), and density of samples, visible
    normals times the Jacobian of reflection (Walter 2007, Heitz 2018): two (n,) [1/sr]."""
    facet = arriving + leaving
    facet /= np.maximum(np.linalg.norm(facet, axis=1, keepdims=True), 1e-300)
    facets = brdf.roughness**2 / (np.pi * (facet[:, 2] ** 2 * (brdf.roughness**2 - 1) + 1) ** 2)
    one, other = arriving[:, 2], np.where(leaving[:, 2] > 0, leaving[:, 2], 1.0)
    masked, shadowed = masking(one, brdf.roughness), masking(other, brdf.roughness)
    radiance = brdf.albedo * facets / (1 + masked + shadowed) / (4 * one * other)
    density = facets / (1 + masked) / (4 * one)
    return [np.where(leaving[:, 2] > 0, values, 0.0) for values in (radiance, density)]


def sphere_grid(across, around):
    """Middles of cells of equal solid angle: (across · around, 3), and that angle [sr]."""
    height = 1 - (np.arange(across) + 0.5) * 2 / across
    azimuth = (np.arange(around) + 0.5) * 2 * np.pi / around - np.pi
    height, azimuth = (grid.ravel() for grid in np.meshgrid(height, azimuth, indexing="ij"))
    level = np.sqrt(1 - height**2)
    return np.column_stack(
        [level * np.cos(azimuth), level * np.sin(azimuth), height]
    ), 4 * np.pi / len(height)


def count_cells(directions, across, around):
    """Directions in each cell of `sphere_grid`."""
    row = np.minimum(((1 - directions[:, 2]) * across / 2).astype(int), across - 1)
    column = (
        (np.arctan2(directions[:, 1], directions[:, 0]) + np.pi) / (2 * np.pi) * around
    ).astype(int) % around
    return np.bincount(row * around + column, minlength=across * around)


@pytest.mark.slow
@pytest.mark.parametrize(("brdf", "zenith"), mark_cases(PAIRS, kept=2), ids=str)
def test_samples_follow_their_density(brdf, zenith):
    """χ² over 20 × 30 cells of the sphere; samples that sink, whose share is 0, count as one cell
    more.
    """
    across, around, fine, count = 20, 30, 30, 200_000
    draws = np.random.default_rng(3).random((count, 3))
    arriving = np.repeat(towards(zenith), count, axis=0)
    leaving, share = brdf.sample(arriving, draws)
    assert np.linalg.norm(leaving, axis=1) == pytest.approx(1, abs=1e-9)
    observed = count_cells(leaving[share > 0], across, around)
    middles, angle = sphere_grid(across * fine, around * fine)
    density = laws(brdf, np.broadcast_to(towards(zenith), middles.shape), middles)[1] * angle
    expected = density.reshape(across, fine, around, fine).sum(axis=(1, 3)).ravel() * count
    assert expected.sum() <= count * 1.002
    observed, expected = (np.append(cells, count - cells.sum()) for cells in (observed, expected))
    # Cells with too few to be expected are thrown together.
    few = expected < 10
    groups = [np.append(cells[~few], cells[few].sum()) for cells in (observed, expected)]
    assert groups[1].size > 5
    if groups[1][-1] < 10:
        groups = [np.append(cells[:-2], cells[-2:].sum()) for cells in groups]
    statistic, chance = stats.chisquare(groups[0], groups[1] * groups[0].sum() / groups[1].sum())
    assert chance > 1e-3, statistic


@pytest.mark.slow
@pytest.mark.parametrize(("brdf", "zenith"), mark_cases(PAIRS, kept=2, law=(1,)), ids=str)
def test_share_is_what_the_law_says(brdf, zenith):
    """Radiance · cos = share · density, sample by sample, and the mean share is the integral of
    radiance · cos.

    Facets lose what meets a second one, and never add any.
    """
    count = 50_000
    arriving = np.repeat(towards(zenith), count, axis=0)
    leaving, share = brdf.sample(arriving, np.random.default_rng(4).random((count, 3)))
    assert share.min() >= 0 and share.max() <= brdf.albedo
    lit = share > 0
    radiance, density = laws(brdf, arriving[lit], leaving[lit])
    assert radiance * leaving[lit, 2] == pytest.approx(share[lit] * density, rel=1e-6)
    middles, angle = sphere_grid(1000, 1000)
    whole = laws(brdf, np.broadcast_to(towards(zenith), middles.shape), middles)[0] * np.maximum(
        middles[:, 2], 0
    )
    error = share.std() / np.sqrt(count)
    assert error < 0.003
    assert share.mean() == pytest.approx(whole.sum() * angle, abs=4 * error + 1e-4)


@pytest.mark.slow
def test_what_glossy_faces_lose():
    """At α = 1 straight on 1 - ln 2 is left, by integration; all over the hemisphere what the
    docstring says.
    """
    draws = np.random.default_rng(6).random((400_000, 3))
    _, share = Glossy(1.0, 1.0).sample(np.repeat(towards(0.0), len(draws), axis=0), draws)
    assert share.mean() == pytest.approx(1 - np.log(2), abs=4 * share.std() / np.sqrt(len(draws)))
    arriving = np.column_stack(cosine_direction(draws[:, 0], draws[:, 1]))
    for roughness, lost in ((0.1, 0.03), (0.3, 0.153), (1.0, 0.593)):
        _, share = Glossy(1.0, roughness).sample(
            arriving, np.random.default_rng(7).random(draws.shape)
        )
        assert 1 - share.mean() == pytest.approx(lost, abs=0.006)


def test_mirror_and_glass_know_one_direction():
    arriving = towards(50.0)
    for brdf, expected in (
        (Mirror(0.7), 0.7),
        (Glass(), reflect_interfaces(arriving[:, 2], 1.52, 2)),
    ):
        leaving, share = brdf.sample(arriving, np.zeros((1, 3)))
        assert leaving == pytest.approx(arriving * [-1, -1, 1])
        assert share == pytest.approx(expected)


def test_fresnel():
    """0.04 straight on at n = 1.5; nothing parallel at Brewster's angle; everything at grazing
    incidence.
    """
    assert fresnel([1.0], 1.5) == pytest.approx(0.04)
    brewster = np.cos(np.arctan(1.5))
    perpendicular, parallel = fresnel([brewster], 1.5)
    assert parallel == pytest.approx(0, abs=1e-15)
    assert perpendicular == pytest.approx(((1.5**2 - 1) / (1.5**2 + 1)) ** 2)  # 0.1479
    assert fresnel([0.0], 1.5) == pytest.approx(1)
    # Born and Wolf, n = 1.52: 4.26 % straight on; half of it at a right angle of both.
    assert reflect_interfaces([1.0], 1.52, 1) == pytest.approx(0.0426, abs=1e-4)


@pytest.mark.parametrize("interfaces", [1, 2, 4])
def test_panes(interfaces):
    """A pane reflects 2R/(1 + R); light that is followed to and fro through the interfaces gives
    the same.
    """
    cosine = np.array([1.0, 0.7, 0.3, 0.05])
    single = fresnel(cosine, 1.5)
    # Add one interface after the other: R' = R + T² r / (1 - R r), with nothing absorbed.
    together = single.copy()
    for _ in range(interfaces - 1):
        together = together + (1 - together) ** 2 * single / (1 - together * single)
    assert reflect_interfaces(cosine, 1.5, interfaces) == pytest.approx(together.mean(axis=0))
    assert (np.diff(reflect_interfaces(cosine, 1.5, interfaces)) > 0).all()
