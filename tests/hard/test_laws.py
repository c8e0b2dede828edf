"""Laws on random scenes: what must hold in any town, whatever it looks like."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as draw
from scenes import join, run_gather, strip, suns_towards, trace_patches
from thorough import draw_count
from towns import city_of_polygons, moved, turned

from citypv.core.city.build_scene import build_scene
from citypv.core.commands.plain_scenes import box, room
from citypv.core.effects.plan_effects import plan_effects
from citypv.core.light import sun_visibility, trace_hemisphere
from citypv.core.patches import find_covered
from citypv.core.patches.patches import Patches
from citypv.core.rays.ray_scene import RayScene
from citypv.core.settings.request import Request

pytestmark = pytest.mark.law

SCENES = draw_count(200, 12, 4)
SUNS = np.array([[0.3, -0.8, 0.6], [-0.5, 0.6, 0.4], [0.9, 0.1, 0.15], [0, 0, 1]])
GRAZING = 1  # of some 57 surfaces × 4 suns
FIELDS = (
    "sky_view_factor",
    "far_ground_view_factor",
    "diffuse_relative",
    "visible_share",
    "direct_reflected",
)
law = settings(max_examples=SCENES, deadline=None, derandomize=True, database=None)
seeds = draw.integers(0, 2**32 - 1)


def random_parts(seed, apart=False):
    """A plain with two to six boxes on it and a leaning board; the boxes apart, or touching and
    inside each other.
    """
    generator = np.random.default_rng(seed)
    parts = [strip([-50, -50, 0], [100, 0, 0], [0, 100, 0], int(generator.integers(1, 6)))]
    count = generator.integers(2, 7)
    for place in generator.permutation(9)[:count]:
        cell = np.append(22.0 * np.array(divmod(place, 3)) - 36, 0)
        corner = np.append(generator.uniform(-30, 20, 2), 0)
        if apart:
            corner = cell + np.append(generator.uniform(0, 5, 2), 0)
        size = generator.uniform([3, 3, 2], [15, 15, 40])
        if (
            not apart and generator.random() < 0.3
        ):  # on a coarse grid, so that walls and edges coincide
            corner, size = np.round(corner / 10) * 10, np.maximum(np.round(size / 10), 1) * 10
        parts += box(corner, corner + size)
    lean = generator.uniform(0.1, 1.4)
    parts.append(strip([-40, 30, 1], [20, 0, 0], [0, 6 * np.cos(lean), 6 * np.sin(lean)], 2))
    return parts


def trace(scene, directions=SUNS, **options):
    """Gather with all surfaces sampled alike: which are eligible depends on size and
    orientation.
    """
    settings = {"samples": 64, "threads": 1, "report": "all", "max_bounces": 3} | options
    return run_gather(scene, suns_towards(directions), **settings)


def assert_same_means(one, other, limit):
    """Means over all surfaces."""
    for name in FIELDS:
        before, after = (
            np.average(getattr(two, name), weights=one.surfaces.area, axis=0)
            for two in (one, other)
        )
        assert after == pytest.approx(before, abs=limit), name


def hemisphere_of(scene, samples=256):
    patches = Patches.of_scene(scene, np.full(len(scene.triangles), 0.25), 0)
    ray_scene = RayScene(scene.vertices, scene.triangles)
    return patches, trace_patches(ray_scene, patches, np.flatnonzero(patches.receives), samples)


@law
@given(seeds)
def test_energy(seed):
    """Each ray goes to the sky, to the far ground, to a face, or is lost on a back: the shares sum
    to 1 where no back is met, and never to more."""
    scene = join(random_parts(seed))
    patches, hemisphere = hemisphere_of(scene)
    met = np.asarray(hemisphere.form_factors.as_matrix().sum(axis=1)).reshape(hemisphere.sky.shape)
    whole = hemisphere.sky + hemisphere.far_ground + met
    assert whole.max() <= 1 + 1e-6
    assert met.min() >= 0
    # Nothing lies behind or around the board and the highest roof: not a ray is lost there.
    highest = np.flatnonzero(
        scene.vertices[scene.triangles][:, :, 2].min(axis=1) == scene.vertices[:, 2].max()
    )
    assert whole[highest] == pytest.approx(1, abs=1e-6)
    assert hemisphere.covered_share.min() >= 0
    assert hemisphere.covered_share.max() <= 1
    assert np.isfinite(patches.offset).all()


@contextmanager
def lit_inside():
    """As if light got into closed rooms, which else are covered all over: nothing is."""
    find = find_covered.find_covered_cells
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            find_covered, "find_covered_cells", lambda *given: np.zeros_like(find(*given))
        )
        yield


@pytest.mark.slow
@law
@given(seeds)
def test_energy_in_a_closed_room(seed):
    """Absorbed is emitted: of E₀ = 1 in a furnished closed room nothing escapes and nothing is
    lost.
    """
    generator = np.random.default_rng(seed)
    low, high = generator.uniform(-5, 0, 3), generator.uniform(1, 6, 3)
    parts = room(low, high)
    for _ in range(generator.integers(0, 3)):
        corner = low + generator.uniform(0.2, 0.6, 3) * (high - low)
        parts += box(corner, corner + 0.3 * (high - low))
    parts = (
        parts
        if generator.random() < 0.5
        else [(turned(points, 33.0), faces) for points, faces in parts]
    )
    with lit_inside():
        empty, furnished = (hemisphere_of(join(some), samples=128) for some in (parts[:6], parts))
    rows = np.asarray(empty[1].form_factors.as_matrix().sum(axis=1))
    assert rows == pytest.approx(1, abs=1e-6)
    for _, hemisphere in (empty, furnished):
        assert hemisphere.sky.max() == hemisphere.far_ground.max() == 0
    assert len(furnished[0]) == 2 * len(parts)


@law
@given(seeds)
def test_reciprocity(seed):
    """A₁ F₁₂ = A₂ F₂₁ between the ground, the buildings and the board, within the spread of the
    replicates.
    """
    scene = join(random_parts(seed, apart=True))
    patches, hemisphere = hemisphere_of(scene)
    group = np.minimum((np.arange(len(patches)) - (len(patches) - 4) % 12) // 12, 3)
    count = len(patches)
    own = np.repeat(np.arange(count), trace_hemisphere.HEMISPHERE_REPLICATES)
    member = np.zeros((count, group.max() + 2))
    member[np.arange(count), group + 1] = 1
    # (p · replicates, g)
    exchanged = patches.area[own, None] * (hemisphere.form_factors.as_matrix() @ member)
    exchanged = exchanged.reshape(count, trace_hemisphere.HEMISPHERE_REPLICATES, -1)
    mean, spread = (
        exchanged.mean(axis=1),
        exchanged.var(axis=1, ddof=1) / trace_hemisphere.HEMISPHERE_REPLICATES,
    )
    total, variance = member.T @ mean, member.T @ spread
    # Replicates see no spread where all rays of a pair agree: one ray's worth of the smaller face
    # is always allowed.
    one_ray = (member.T @ (patches.area / 256) ** 2)[None, :]
    bound = 5 * np.sqrt(variance + variance.T + one_ray + one_ray.T)
    assert (np.abs(total - total.T) <= bound).all()


@pytest.mark.slow
@law
@given(seeds, draw.floats(0, 360))
def test_turning_the_town_with_the_sun(seed, angle):
    """The light stays, but for shadow points at the very edge of a shadow: turned coordinates are
    rounded otherwise.
    """
    parts = random_parts(seed, apart=True)
    scene = join(parts)
    spun = join([(turned(points, angle), faces) for points, faces in parts])
    one, other = trace(scene), trace(spun, turned(SUNS, angle))
    changed = np.abs(other.visible_share - one.visible_share) > 1e-6
    assert changed.sum() <= GRAZING
    one.visible_share[changed] = other.visible_share[changed]
    assert_same_means(one, other, 1e-3)
    assert np.median(np.abs(other.diffuse_relative - one.diffuse_relative)) < 5e-4


@law
@given(seeds, draw.tuples(*[draw.integers(-(10**10), 10**10)] * 3))
def test_moving_the_town_before_it_is_read(seed, millimetres):
    """Up to 10,000 km away, by any number of millimetres: not a bit of the result changes."""
    generator = np.random.default_rng(seed)
    polygons = []
    for _ in range(3):
        corner, size = (
            np.round(generator.uniform(0, 40, 3), 3),
            np.round(generator.uniform(3, 12, 3), 3),
        )
        for points, faces in box(corner * [1, 1, 0], corner * [1, 1, 0] + size):
            polygons.append(
                points[[*faces[0], faces[1][2]]] if len(points) == 4 else points[faces[0]]
            )
    there = [np.round(moved(polygon, np.array(millimetres) / 1000), 3) for polygon in polygons]
    scenes = [
        build_scene(city_of_polygons(list(rows)), 52.5, 13.4, ground="none")
        for rows in (polygons, there)
    ]
    assert np.array_equal(scenes[0].vertices, scenes[1].vertices)
    assert np.array_equal(scenes[0].triangles, scenes[1].triangles)


@pytest.mark.slow
@law
@given(seeds)
def test_permuting_the_faces(seed):
    """The same faces in another order, each with its name: the same light for each name."""
    scene = join(random_parts(seed))
    order = np.random.default_rng(seed).permutation(len(scene.triangles))
    names = {
        name: [getattr(scene.surfaces, name)[place] for place in order]
        for name in ("surface_id", "building_id")
    }
    columns = (
        "kind",
        "orientation",
        "eligible",
        "area",
        "surface_tilt",
        "surface_azimuth",
        "normal",
    )
    surfaces = replace(
        scene.surfaces, **names, **{name: getattr(scene.surfaces, name)[order] for name in columns}
    )
    shuffled = replace(scene, triangles=scene.triangles[order], surfaces=surfaces)
    one, other = trace(scene), trace(shuffled)
    for name in FIELDS:
        before, after = getattr(one, name)[order], getattr(other, name)
        # A ray that meets two coincident faces may be answered by either.
        assert np.average(np.abs(after - before)) < 2e-3, name
    assert np.array_equal(one.visible_share[order], other.visible_share)
    assert np.array_equal(one.sky_view_factor[order], other.sky_view_factor)


@pytest.mark.slow
@law
@given(seeds, draw.integers(2, 7), draw.sampled_from([100, 1000, 4096]))
def test_threads_and_chunks(seed, threads, chunk):
    scene = join(random_parts(seed))
    one = trace(scene, threads=1)
    before = trace_hemisphere.RAYS_PER_TASK, sun_visibility.POINTS_PER_TASK
    try:
        trace_hemisphere.RAYS_PER_TASK, sun_visibility.POINTS_PER_TASK = chunk, chunk
        other = trace(scene, threads=threads)
    finally:
        trace_hemisphere.RAYS_PER_TASK, sun_visibility.POINTS_PER_TASK = before
    for name in (
        *FIELDS,
        "covered_share",
        "diffuse_relative_standard_error",
        "direct_annual_standard_error",
    ):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


@pytest.mark.slow
@law
@given(seeds)
def test_rays_that_are_not_sent_would_be_free(seed):
    """Patches with nothing in front of them, and suns behind them: with all shadow rays sent, the
    same to the last bit; with all sky rays sent, no ray of such a patch meets anything."""
    scene = join(random_parts(seed))
    spared, sent = (
        trace(scene, max_bounces=0, effects=effects) for effects in ({}, {"shadow-rays": True})
    )
    assert np.array_equal(spared.visible_share, sent.visible_share)
    assert spared.record.shadow_rays < sent.record.shadow_rays
    patches, hemisphere = hemisphere_of(scene)
    unobstructed = plan_effects(scene, patches, Request()).unobstructed
    assert unobstructed.any()
    assert (hemisphere.sky + hemisphere.far_ground)[unobstructed & patches.receives].min() == 1


@pytest.mark.slow
@law
@given(seeds)
def test_a_new_building_never_adds_direct_light(seed):
    parts = random_parts(seed)
    generator = np.random.default_rng(seed + 1)
    corner = np.append(generator.uniform(-30, 20, 2), 0)
    more = [*parts, *box(corner, corner + generator.uniform(3, 20, 3))]
    settings = {"max_bounces": 0, "effects": {"sky-rays": True, "shadow-rays": True}}
    before, after = (trace(join(rows), **settings) for rows in (parts, more))
    count = len(before.visible_share)
    assert (after.visible_share[:count] <= before.visible_share).all()
    assert (after.sky_view_factor[:count] <= before.sky_view_factor).all()


@pytest.mark.slow
@law
@given(seeds, draw.sampled_from([1e-3, 10.0, 1000.0, 1024.0]), draw.booleans())
def test_any_scale(seed, scale, apart):
    """A town a thousand times as large has the same factors, by a clearance as many times as wide,
    but where two faces coincide: a ray may meet either, and either has its own random points."""
    parts = random_parts(seed, apart=apart)
    one = trace(join(parts), clearance=0.3)
    large = join([(points * scale, faces) for points, faces in parts])
    other = trace(large, clearance=0.3 * scale)
    assert_same_means(one, other, 1e-6 if apart else 2e-3)
