"""The forward estimator against values known without a ray tracer, and against the paper's own way
of sending rays.
"""

import numpy as np
import pytest
from scenes import join, run_forward, scene_of_triangles, strip, suns_towards
from scipy import stats
from test_closed_forms import SUNS, tilted_square
from test_tracing import three_houses
from thorough import mark_cases

from citypv.core.commands.plain_scenes import room
from citypv.core.light.emit_photons import FROM_ABOVE, box_of_scene, make_source
from citypv.core.light.follow_photons import (
    Photons,
    Target,
    meet_fronts,
    reflect_photons,
)
from citypv.core.light.light_of_photons import Tally
from citypv.core.light.trace_sources import PHOTON_REPLICATES
from citypv.core.patches.brdfs import Mirror
from citypv.core.patches.patches import Patches
from citypv.core.patches.read_albedo import TriangleBrdfs
from citypv.core.rays.ray_scene import HitPlaces, RayScene
from citypv.core.rays.sample_points import barycentric_of_square, cosine_direction


def trace(scene, suns=SUNS, **settings):
    return run_forward(scene, suns, **settings)


def paper_hemisphere(scene, radius, count, seed):
    """Eq. 1 and 2 as they stand: starts on a hemisphere, Lambertian directions inwards, those that
    rise discarded.
    """
    generator = np.random.default_rng(seed)
    around, height = generator.uniform(0, 2 * np.pi, count), generator.uniform(0, 1, count)
    level = np.sqrt(1 - height**2)
    outwards = np.column_stack([level * np.cos(around), level * np.sin(around), height])
    # Lambertian about the inward normal: a point of the unit sphere added to it.
    scattered = generator.normal(size=(count, 3))
    directions = scattered / np.linalg.norm(scattered, axis=1, keepdims=True) - outwards
    falls = directions[:, 2] < 0
    ray_scene = RayScene(scene.vertices, scene.triangles)
    directions = directions[falls].astype(np.float32)
    hit = ray_scene.trace_closest((radius * outwards[falls]).astype(np.float32), directions)
    front = np.flatnonzero(hit >= 0)
    front = front[np.einsum("ij,ij->i", directions[front], scene.surfaces.normal[hit[front]]) < 0]
    hits = np.bincount(hit[front], minlength=len(scene.triangles))
    density = count / (2 * np.pi * radius**2)  # Eq. 1
    return hits / scene.surfaces.area / density, np.sqrt(
        np.maximum(hits, 1)
    ) / scene.surfaces.area / density


@pytest.mark.slow
@pytest.mark.parametrize("radius", [60.0, 120.0])
def test_the_box_sends_the_light_of_the_papers_hemisphere(radius):
    """At any radius, for rays that rise are discarded."""
    scene = three_houses()
    paper, error = paper_hemisphere(scene, radius, 1_000_000, 1)
    transfer = trace(scene, max_bounces=0, samples=8000)
    total = np.hypot(error, transfer.diffuse_relative_standard_error)
    lit = paper > 0
    assert lit.sum() > 30
    assert (np.abs(transfer.diffuse_relative - paper)[lit] < 4.5 * total[lit]).all()
    ratio = (paper @ scene.surfaces.area) / (transfer.diffuse_relative @ scene.surfaces.area)
    assert ratio == pytest.approx(1, abs=0.005)  # rays that rise would add 1 %


def test_sun_at_zenith_on_the_horizon_and_in_the_plane_of_walls():
    walls = (
        strip([-5, 0, 0], [10, 0, 0], [0, 0, 10], 1),
        strip([10, 5, 0], [0, 10, 0], [0, 0, 10], 1),
    )
    scene = join([strip([-20, -20, 0], [40, 0, 0], [0, 40, 0], 2), *walls])
    transfer = trace(
        scene, suns_towards([[0, 0, 1], [0, -1, 0], [1e-9, 0, 1]]), samples=2000, max_bounces=0
    )
    ground, south, east = (slice(0, 4), slice(4, 6), slice(6, 8))
    for zenith in (0, 2):
        assert transfer.visible_share[ground, zenith] == pytest.approx(1, abs=0.02)
        assert transfer.visible_share[4:, zenith].max() == 0
    assert transfer.visible_share[south, 1] == pytest.approx(1, abs=0.02)
    assert transfer.visible_share[ground, 1].max() == transfer.visible_share[east, 1].max() == 0


@pytest.mark.slow
@pytest.mark.law
def test_where_the_light_goes():
    """Absorbed, escaped and lost light is what was emitted, exactly: the weights are multiples of
    2⁻²⁶.
    """
    transfer = trace(three_houses(), samples=2000, albedo=0.3, ground_albedo=0.7, max_bounces=4)
    for tally in transfer.record.photons.values():
        assert sum(tally.values()) == 2 * tally["emitted"]
        assert min(tally["escaped"], tally["absorbed"]) > 0
    whole = transfer.record.photons["sky"]["emitted"]
    power = make_source("sky", box_of_scene(three_houses()), 0, FROM_ABOVE).power.sum()
    # What the surfaces are said to receive of the sky is what its photons left on them, less the
    # far ground's part.
    dark = trace(three_houses(), samples=2000, albedo=0, ground_albedo=0)
    absorbed = dark.record.photons["sky"]["absorbed"] / whole * power
    assert dark.diffuse_relative @ dark.surfaces.area == pytest.approx(absorbed, rel=1e-9)


@pytest.mark.parametrize(
    ("albedo", "bounces", "mirrors"),
    mark_cases(
        [(0.0, 1, 0), (0.25, 0, 6), (0.25, 3, 12), (0.999, 50, 6), (1.0, 1, 12), (1.0, 50, 0)],
        law=(1, 2),
    ),
)
def test_closed_furnace(albedo, bounces, mirrors):
    """In a closed room with E₀ = 1 everywhere E is (1 - ρⁿ⁺¹)/(1 - ρ), n + 1 at ρ = 1: not a photon
    finds a way out.

    Even light stays even, whether dull faces reflect it or mirrors.
    """
    scene = join(room((0, 0, 0), (4, 5, 3)))
    patches = Patches.of_scene(scene, np.full(12, albedo), 0)
    brdfs = TriangleBrdfs([Mirror(albedo)], np.where(np.arange(12) < mirrors, 0, -1))
    ray_scene = RayScene(scene.vertices, scene.triangles)
    target = Target(ray_scene, patches, np.arange(12), 12, np.zeros((12, 64), bool), brdfs)
    count = 20_000
    generator = np.random.default_rng(0)
    hit = generator.choice(12, count, p=patches.area / patches.area.sum())
    places = HitPlaces(hit, *barycentric_of_square(*generator.random((2, count), np.float32)))
    _, outwards = patches.leave(places, cosine_direction(*generator.random((2, count))))
    photons = Photons(
        np.zeros((count, 3)), -outwards, np.ones(count), np.arange(count), np.zeros(count, int)
    )
    received = np.bincount(places[0], photons.weight, 12)
    tally = Tally()
    for bounce in range(bounces):
        photons = reflect_photons(target, np.uint64(7), photons, places, bounce)
        photons, places = meet_fronts(target, photons, tally)
        received += np.bincount(places[0], photons.weight, 12)
    expected = bounces + 1 if albedo == 1 else (1 - albedo ** (bounces + 1)) / (1 - albedo)
    assert received.sum() == pytest.approx(count * expected, rel=1e-6)
    assert tally.escaped == tally.on_backs == tally.closure == 0
    assert received * patches.area.sum() / patches.area / count == pytest.approx(expected, rel=0.1)


@pytest.mark.slow
@pytest.mark.thorough
def test_standard_error_is_that_of_the_noise():
    """Errors over standard errors follow Student's t with the fifteen degrees of freedom of sixteen
    replicates.
    """
    quotients = []
    for seed in range(150):
        transfer = trace(
            tilted_square(60), suns_towards([[0, 0, 1]]), samples=1600, seed=seed, threads=1
        )
        quotients.append(
            (transfer.diffuse_relative - 0.8125) / transfer.diffuse_relative_standard_error
        )
    assert stats.kstest(np.concatenate(quotients), "t", args=(PHOTON_REPLICATES - 1,)).pvalue > 0.01
    assert 0.7 < np.std(quotients) < 1.4


def test_nothing_that_receives_and_no_sun():
    """A floor that lies on the ground, under no sun at all."""
    scene = scene_of_triangles([[0, 0, 0], [0, 2, 0], [3, 0, 0], [3, 2, 0]], [[0, 1, 2]])
    scene.footprint[:] = True
    empty = suns_towards([[0, 0, 1]])
    for name in ("direction", "weight", "day", "step"):
        setattr(empty, name, getattr(empty, name)[:0])
    transfer = trace(scene, empty)
    assert transfer.diffuse_relative == transfer.sky_view_factor == 0
    assert transfer.visible_share.shape == (1, 0)
