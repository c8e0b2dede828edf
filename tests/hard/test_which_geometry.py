"""Which geometry: duplicates, party walls, slivers, needles, shafts, gaps and edges, each with its
right light.
"""

import numpy as np
import pytest
from scenes import join, run_gather, strip, suns_towards
from thorough import mark_cases
from towns import spun

from citypv.core.commands.plain_scenes import box, room

SUNS = suns_towards([[0.3, -0.8, 0.6], [-0.5, 0.6, 0.4], [0, 0, 1]])
ALBEDO = 0.25
# every patch sends rays, also those known in closed form
RAYS = {
    "sky-rays": True,
    "shadow-rays": True,
}


def trace(parts, suns=SUNS, **settings):
    scene = parts if hasattr(parts, "triangles") else join(parts)
    settings = {"samples": 4096, "shadow_samples": 256, "effects": RAYS} | settings
    return run_gather(scene, suns, **settings)


def assert_unshaded(transfer, chosen, sample_error=0.01):
    """Sky, far ground and every sun in front of a face reach it as if it stood alone."""
    normal, sun = transfer.surfaces.normal[chosen], transfer.suns.direction
    assert transfer.sky_view_factor[chosen] == pytest.approx(
        (1 + normal[:, 2]) / 2, abs=sample_error
    )
    whole = transfer.sky_view_factor[chosen] + transfer.far_ground_view_factor[chosen]
    assert whole == pytest.approx(1, abs=1e-6)
    assert transfer.visible_share[chosen] == pytest.approx(
        (normal @ sun.T > 1e-6).astype(float), abs=1e-6
    )
    assert transfer.covered_share[chosen].max() == 0


def square(size, turn, away=(0, 0, 0), cells=1):
    points, faces = strip([-size / 2, -size / 2, 0], [size, 0, 0], [0, size, 0], cells)
    return points @ turn.T + away, faces


# No acne


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "cells", "away"),
    mark_cases([(0.1, 1, 0.0), (0.1, 1, 1e4), (10, 20, 100.0), (1000, 3, 1e4)], kept=2),
)
def test_an_unshaded_face_gets_its_closed_form_at_every_incidence(size, cells, away):
    """Suns from straight above the face down to 0.1° above its plane, all around, and a face turned
    any way.
    """
    generator = np.random.default_rng(3)
    for _ in range(6):
        turn = spun(generator)
        angle, around = np.radians([90, 30, 5, 1, 0.3, 0.1]), np.radians(np.arange(0, 360, 40))
        local = [
            [np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)] for a in angle for b in around
        ]
        towards = np.array(local) @ turn.T
        kept = towards[:, 2] > 1e-3
        scene = join([square(size, turn, away * generator.normal(size=3), cells)])
        transfer = trace(scene, suns_towards(towards[kept]), samples=1024, shadow_samples=64)
        assert transfer.visible_share == pytest.approx(1, abs=1e-6)
        whole = transfer.sky_view_factor + transfer.far_ground_view_factor
        assert whole == pytest.approx(1, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("large", "small"), [(50.0, 0.01), (1000.0, 1.0), (1e5, 0.01)])
def test_small_faces_beside_a_large_one_in_the_same_plane(large, small):
    """T-junctions all along a long edge: the large face's plane is only known to the rounding of
    its far corners.
    """
    generator = np.random.default_rng(4)
    for _ in range(8):
        turn = spun(generator)
        parts = [strip([0, -large / 2, 0], [large, 0, 0], [0, large, 0], 1)]
        parts += [
            strip([-small, small * place, 0], [small, 0, 0], [0, small, 0], 1) for place in range(8)
        ]
        parts = [(points @ turn.T, faces) for points, faces in parts]
        transfer = trace(join(parts), samples=512, shadow_samples=16)
        assert_unshaded(transfer, np.arange(2, 18), sample_error=0.04)


# No leaks


def assert_dark(transfer):
    for name in ("sky_view_factor", "far_ground_view_factor", "visible_share", "diffuse_relative"):
        assert getattr(transfer, name).max() < 1e-6, name


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "seed"),
    mark_cases([(0.01, None), (1.0, 0), (10.0, 1), (1000.0, None)], kept=2, law=(1,)),
)
def test_a_closed_box_around_everything_is_dark(size, seed):
    """Along the axes, or turned any way and 300 m away."""
    generator = np.random.default_rng(seed)
    turn, away = (
        (np.eye(3), 0) if seed is None else (spun(generator), 300 * generator.normal(size=3))
    )
    inside = [
        *room((0, 0, 0), (size, 0.4 * size, 0.7 * size)),
        *box(*np.outer([0.1, 0.3], [size] * 3)),
    ]
    turned = [(points @ turn.T + away, faces) for points, faces in inside]
    assert_dark(trace(turned, samples=16384, shadow_samples=1024))


# Doubles and neighbours


@pytest.mark.parametrize("gap", [0.0, 1e-7, 1e-4, 1e-2])
def test_a_face_in_front_of_another(gap):
    """A roof laid on a roof, at no distance or next to none: the upper one is never touched, the
    lower one is either the same face or hidden, never in between."""
    lower, upper = (
        strip([0, 0, 5], [10, 0, 0], [0, 10, 0], 1),
        strip([0, 0, 5 + gap], [10, 0, 0], [0, 10, 0], 1),
    )
    transfer = trace([lower, upper])
    assert_unshaded(transfer, np.array([2, 3]), sample_error=1e-6)
    below = transfer.visible_share[:2]
    assert np.minimum(below, 1 - below).max() < 1e-6
    if gap >= 1e-4:
        assert transfer.covered_share[:2] == pytest.approx(1)
        assert transfer.diffuse_relative[:2].max() < 1e-6
    else:
        assert transfer.sky_view_factor[:2] == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("gap", [0.0, 1e-7, 1e-4, 1e-2])
def test_walls_between_touching_buildings_receive_nothing(gap):
    transfer = trace(
        [*box((0, 0, 0), (10, 10, 10)), *box((10 + gap, 0, 0), (20, 10, 10))], max_bounces=3
    )
    shared = [8, 9, 12 + 10, 12 + 11]
    # Through a gap of 1 cm the sky shows at its edges; of 0.1 mm nothing is left.
    allowed = 4 * gap / 10 + 1e-6
    assert transfer.sky_view_factor[shared].max() <= allowed
    assert transfer.visible_share[shared].max() <= 4 * allowed
    assert transfer.diffuse_relative[shared].max() <= 2 * allowed
    assert_unshaded(transfer, np.array([0, 1, 12, 13]), sample_error=1e-6)


@pytest.mark.slow
def test_t_junctions_in_a_wall_let_no_light_through():
    """A room whose walls are cut differently on both sides of each edge."""
    inside = room((0, 0, 0), (5, 4, 3))
    # the south wall in seven strips that meet the others' long edges
    cut = strip([0, 0, 3], [5, 0, 0], [0, 0, -3], 7)
    faces = [*inside[:2], cut, *inside[3:]]
    transfer = trace(faces, samples=65536, shadow_samples=1024)
    assert transfer.surfaces.normal[4:18] == pytest.approx(np.tile([0.0, 1, 0], (14, 1)))
    assert_dark(transfer)


# At the foot


@pytest.mark.parametrize("height", [-1e-3, 0.0, 1e-3])
def test_ground_at_the_foot_of_the_walls(height):
    """Walls that end at the ground, 1 mm above it or below it see half the sky and the lit ground,
    to a millimetre's share."""
    ground = strip([-500, -500, height], [1000, 0, 0], [0, 1000, 0], 1)
    transfer = trace([ground, *box((-5, -5, 0), (5, 5, 10))], samples=1 << 14, far_ground=False)
    walls = 2 + np.arange(4, 12)
    assert transfer.sky_view_factor[walls] == pytest.approx(0.5, abs=0.002)
    front = transfer.surfaces.normal[walls] @ SUNS.direction.T > 1e-6
    assert transfer.visible_share[walls] == pytest.approx(front.astype(float), abs=5e-4)
    assert transfer.covered_share[walls].max() <= 1 / 64
    floor = [4, 5]
    assert transfer.sky_view_factor[floor].max() == 0
    assert transfer.diffuse_relative[floor].max() <= 0.01


@pytest.mark.slow
def test_a_face_seen_edge_on_by_the_sun_receives_nothing_and_casts_no_shadow():
    generator = np.random.default_rng(7)
    for _ in range(5):
        turn = spun(generator)
        sun = turn @ [np.cos(1.0), np.sin(1.0), 0]
        sun *= np.sign(sun[2])
        face = square(10, turn, away=[0, 0, 50])
        transfer = trace(
            [face, strip([-100, -100, 0], [200, 0, 0], [0, 200, 0], 4)], suns_towards([sun])
        )
        assert transfer.visible_share[:2].max() == 0
        assert transfer.visible_share[2:].mean() > 0.9999


@pytest.mark.parametrize("height", [0.0, 0.005, 3.0])
def test_a_floor_on_a_roof_rests_on_it(height):
    """A house on the roof of another, or on stilts above it."""
    transfer = trace(
        [*box((-20, -20, 0), (20, 20, 10)), *box((-5, -5, 10 + height), (5, 5, 15 + height))]
    )
    floor = [14, 15]
    if height < 0.01:
        assert transfer.diffuse_relative[floor].max() == 0
        assert transfer.covered_share[floor] == pytest.approx(1)
    else:
        assert transfer.diffuse_relative[floor].min() > 0.05
        assert transfer.covered_share[floor].max() == 0
