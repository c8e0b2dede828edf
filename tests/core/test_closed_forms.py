"""Unshaded surfaces and the infinite street canyon: values known without a ray tracer."""

import numpy as np
import pytest
from radiosity import canyon_after_bounces
from scenes import assert_mean, join, run_gather, scene_of_triangles, strip, suns_towards

from citypv.core.light.trace_gather import trace_gather
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request

ALBEDO = 0.25
SUNS = suns_towards([[0, -1, 1], [0.3, -0.9, 0.2], [1, 0.4, 0.5], [-0.2, 1, 0.05], [0, 0, 1]])


def tilted_square(tilt):
    """A unit square that looks south, raised above the ground, so that nothing stands in front of it."""
    turn = np.radians(tilt)
    up = np.array([0, np.cos(turn), np.sin(turn)])
    east = np.array([1.0, 0, 0])
    corner = np.array([0, 0, 5.0])
    points = np.array([corner, corner + east, corner + east + up, corner + up])
    return scene_of_triangles(points, [[0, 1, 2], [0, 2, 3]], [0, 0])


def direct_relative(transfer):
    """Direct irradiance per DNI for every traced sun, put together from its three parts."""
    height = transfer.suns.direction[:, 2]
    first = np.maximum(transfer.surfaces.normal @ transfer.suns.direction.T, 0) * transfer.visible_share
    return (
        first + transfer.direct_reflected + np.outer(transfer.far_ground_view_factor, transfer.ground_albedo * height)
    )


@pytest.mark.parametrize(("tilt", "expected"), [(0, 1.0), (30, 0.949759526), (60, 0.8125), (90, 0.625)])
@pytest.mark.parametrize("rays", [False, True])
def test_unshaded_surface(tilt, expected, rays):
    """Eq. 9 and Eq. 11 of the paper, by closed form and by rays."""
    request = Request(samples=16384, shadow_samples=16, effects={"sky-rays": True, "shadow-rays": True} if rays else {})
    transfer = trace_gather(tilted_square(tilt), SUNS, request, silent)
    error = transfer.diffuse_relative_standard_error
    if rays:
        assert transfer.record.hemisphere_rays == 2 * 16384
        assert (error < 0.005).all()
        assert_mean(transfer.diffuse_relative, error + 1e-7, expected)
    else:
        assert transfer.record.hemisphere_rays == transfer.record.shadow_rays == 0
        assert error == 0
        assert transfer.diffuse_relative == pytest.approx(expected, abs=1e-7)
    normal = np.array([0, -np.sin(np.radians(tilt)), np.cos(np.radians(tilt))])
    ground_view = (1 - normal[2]) / 2
    eq_11 = np.maximum(SUNS.direction @ normal, 0) + ALBEDO * ground_view * SUNS.direction[:, 2]
    assert transfer.visible_share.ravel() == pytest.approx((SUNS.direction @ normal > 1e-9).astype(float))
    assert direct_relative(transfer).ravel() == pytest.approx(eq_11, abs=0.005 if rays else 1e-6)


def test_far_ground_off_leaves_the_sky_only():
    transfer = run_gather(tilted_square(90), SUNS, far_ground=False)
    assert transfer.diffuse_relative == pytest.approx(0.5, abs=1e-7)
    assert transfer.direct_reflected.max() == 0
    assert transfer.ground_albedo == 0


def canyon(strips=50, far=100.0, middle=10.0):
    """Street canyon H = W = 1 along x: its middle part is what counts, long ends keep the ends away.

    Returns
    -------
    scene : Scene
    ground, wall : (k,) int
        Surfaces of the middle part.
    """
    parts, names = [], []
    for start, end in ((-far, -middle), (-middle, middle), (middle, far)):
        length = [end - start, 0, 0]
        parts += [
            strip([start, 0, 0], length, [0, 1, 0], strips),
            strip([start, 1, 0], length, [0, 0, 1], strips),
            strip([start, 0, 1], length, [0, 0, -1], strips),
        ]
        names += [f"{part}{'' if start == -middle else ' end'}" for part in ("ground", "wall", "wall")]
    scene = join(parts)
    name_of = np.repeat(names, 2 * strips)
    return scene, np.flatnonzero(name_of == "ground"), np.flatnonzero(name_of == "wall")


@pytest.mark.parametrize("bounces", [0, 1, 2, 3])
def test_street_canyon(bounces):
    """Mean over wall and ground of the canyon H/W = 1 after 0 to 3 reflections against numeric radiosity."""
    scene, ground, wall = canyon()
    request = Request(max_bounces=bounces, samples=4096, far_ground=False)
    transfer = trace_gather(scene, suns_towards([[0, 0, 1]]), request, silent)
    known_wall = (0.292893, 0.353350, 0.362375, 0.363992)[bounces]
    known_ground = (0.414214, 0.451931, 0.461190, 0.462563)[bounces]
    computed = canyon_after_bounces(1, 1, ALBEDO, bounces)
    assert computed[0][-1] == pytest.approx(known_wall, abs=2e-6)
    assert computed[1][-1] == pytest.approx(known_ground, abs=2e-6)
    for chosen, known in ((wall, known_wall), (ground, known_ground)):
        area = scene.surfaces.area[chosen]
        mean = np.average(transfer.diffuse_relative[chosen], weights=area)
        error = np.sqrt(((area * transfer.diffuse_relative_standard_error[chosen]) ** 2).sum()) / area.sum()
        assert error < 4e-4  # small enough to tell two bounces from three
        assert_mean(mean, error, known)
