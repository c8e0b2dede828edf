"""Laws of the forward estimator on random scenes: the light that gather finds, and none lost."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from scenes import RUNS, join, scene_of_triangles, suns_towards
from test_forward_agrees import group_means
from test_laws import SUNS, random_parts, seeds
from test_laws import law as law_of_gather
from thorough import draw_count
from towns import spun

from citypv.core.city.split_edges import refine_triangles
from citypv.core.commands.plain_scenes import room
from citypv.core.light import trace_sources

SCENES = draw_count(200, 6, 4)
law = settings(law_of_gather, max_examples=SCENES)

# of the reflected part: what gather errs by where light is even over patches of six metres
PATCHES = 0.04
FIELDS = (
    "diffuse_relative",
    "visible_share",
    "direct_reflected",
    "diffuse_relative_standard_error",
)


def random_scene(seed):
    """Boxes on a plain, apart from each other, in patches of six metres; one surface for
    each side.
    """
    scene = join(random_parts(seed, apart=True))
    vertices, triangles, parent = refine_triangles(scene.vertices, scene.triangles, 6.0)
    return scene_of_triangles(vertices, triangles, parent)


def trace(scene, estimator, **options):
    return RUNS[estimator](scene, suns_towards(SUNS), **{"threads": 1} | options)


def group_light(transfer):
    """Means and standard errors of diffuse and annual direct light, by kind and orientation: two (2
    g,).
    """
    return np.array([pair for pairs in group_means(transfer, least=1).values() for pair in pairs]).T


@pytest.mark.slow
def test_gather_and_forward_agree():
    """Within their errors on every scene; over all scenes the differences are as large as the
    errors, and not biased.

    The plain and the boxes' upper sides take part; the first hits must agree without any allowance.
    The horizon, which is no part of the comparison, is left out.
    """
    collected = {0: [], 2: []}

    @law
    @given(seeds)
    def agree(seed):
        scene, dark = random_scene(seed), None
        for bounces, found in collected.items():
            options = {"max_bounces": bounces, "effects": {"perez": False}}
            one, s = group_light(trace(scene, "gather", samples=64, **options))
            other, t = group_light(trace(scene, "forward", samples=24, **options))
            dark = one if bounces == 0 else dark
            error, allowance = np.hypot(s, t), PATCHES * (one - dark)
            lit = error > 1e-6
            assert (np.abs(one - other) <= 5 * error + allowance + 1e-6).all()
            found.append((one - other)[lit] / error[lit])

    agree()
    for bounces, found in collected.items():
        z = np.concatenate(found)
        assert len(found) >= SCENES
        assert len(z) > 7.5 * SCENES
        assert 0.75 < np.sqrt(np.mean(z**2)) < 1.25
        assert abs(z.mean()) < (0.25 if bounces else 4 / np.sqrt(len(z)))


@pytest.mark.slow
@pytest.mark.law
@law
@given(seeds)
def test_energy(seed):
    """Everything emitted is absorbed, escapes or is lost on backs; the remainder is 0, not 10⁻⁶."""
    transfer = trace(
        join(random_parts(seed)),
        "forward",
        samples=16,
        albedo=0.37,
        ground_albedo=0.81,
        max_bounces=6,
    )
    for tally in transfer.record.photons.values():
        assert tally["emitted"] > 0
        assert sum(tally.values()) == 2 * tally["emitted"]
        assert min(tally.values()) >= 0


@pytest.mark.slow
@pytest.mark.law
@law
@given(seeds)
def test_threads_and_chunks(seed):
    scene = join(random_parts(seed))
    one = trace(scene, "forward", samples=8)
    before = trace_sources.PHOTONS_PER_TASK
    try:
        trace_sources.PHOTONS_PER_TASK = 60
        other = trace(scene, "forward", samples=8, threads=5)
    finally:
        trace_sources.PHOTONS_PER_TASK = before
    for name in FIELDS:
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    assert one.record.photons == other.record.photons


@pytest.mark.slow
@pytest.mark.law
@law
@given(seeds)
@example(5071)  # a photon along an edge, between the back of one wall and the front of the next
def test_a_closed_room_stays_dark(seed):
    """Not one photon of sky, sun or far ground finds a way in."""
    generator = np.random.default_rng(seed)
    low, high = generator.uniform(-5, 0, 3), generator.uniform(1, 6, 3)
    turn = spun(generator)
    inside = join([(points @ turn.T + [900, -700, 50], faces) for points, faces in room(low, high)])
    transfer = trace(inside, "forward", samples=256)
    assert (
        transfer.diffuse_relative.max()
        == transfer.visible_share.max()
        == transfer.direct_reflected.max()
        == 0
    )
