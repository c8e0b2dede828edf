"""Places inside and under buildings: dark, and no loss to their neighbours."""

import numpy as np
import pytest
from scenes import join, run_gather, strip, suns_towards

from citypv.core.commands.plain_scenes import box

SUN = suns_towards([[0.2, -0.5, 1], [0.7, 0.7, 0.6]])


def test_ground_under_a_building_is_covered():
    """A square of ground of 20 m with a house of 10 m on it: a quarter of it is covered and gets nothing."""
    ground = strip([-10, -10, 0], [20, 0, 0], [0, 20, 0], 1)
    scene = join([ground, *box((-5, -5, 0), (5, 5, 8))])
    transfer = run_gather(scene, SUN, samples=4096, shadow_samples=256)
    assert transfer.covered_share[:2].mean() == pytest.approx(0.25, abs=0.03)
    assert transfer.covered_share[2:4].max() == 0  # roof
    assert (transfer.sky_view_factor[:2] < 0.75).all()


def test_covered_parts_stay_dark_without_shadow_rays():
    """A low house stands against half of a wall: of any sun the wall gets half of what it would get alone."""
    scene = join([*box((0, 0, 0), (10, 10, 10)), *box((0, -10, 0), (10, 0, 5))])
    wall = np.flatnonzero(
        (scene.surfaces.surface_azimuth == 180) & (scene.vertices[scene.triangles][:, :, 1] == 0).all(1)
    )
    transfer = run_gather(scene, SUN, effects={"shadow-rays": False})
    assert len(wall) == 2 and transfer.covered_share[wall].mean() == pytest.approx(0.5, abs=0.02)
    seen = transfer.visible_share[wall, 0]  # the first sun stands before it
    assert seen == pytest.approx(1 - transfer.covered_share[wall], abs=1e-6)


def test_covered_ground_hands_on_all_its_light():
    """A wall stands before a plain, whose patches end at the wall or go on under the house: that is the same."""
    depth = 200.0
    house = box((-depth, 0, 0), (depth, depth, 10))
    whole = join([strip([-depth, -depth, 0], [2 * depth, 0, 0], [0, 2 * depth, 0], 65), *house])
    half = join([strip([-depth, -depth, 0], [2 * depth, 0, 0], [0, depth, 0], 32), *house])
    walls = []
    for scene in (whole, half):
        transfer = run_gather(scene, SUN, samples=16384, max_bounces=1, far_ground=False)
        south = np.flatnonzero((transfer.surfaces.surface_azimuth == 180) & (transfer.surfaces.surface_tilt == 90))
        walls.append(np.average(transfer.diffuse_relative[south] - transfer.sky_view_factor[south]))
    assert walls[1] > 0.09
    assert walls[0] == pytest.approx(walls[1], rel=0.02)
