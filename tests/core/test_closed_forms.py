"""Unshaded surfaces and the infinite street canyon: values known without a ray tracer, by either
estimator.
"""

from functools import partial

import numpy as np
import pytest
from radiosity import canyon_after_bounces
from scenes import (
    assert_mean,
    join,
    run_forward,
    run_gather,
    scene_of_triangles,
    strip,
    suns_towards,
)
from thorough import mark_cases

WAYS = {  # what the plan gives without a ray, rays all the same, and photons; and how many of them
    "plan": partial(run_gather, samples=4),
    "rays": partial(
        run_gather,
        samples=16384,
        shadow_samples=16,
        effects={"sky-rays": True, "shadow-rays": True},
    ),
    "photons": partial(run_forward, samples=100_000),
}
ALBEDO = 0.25
SUNS = suns_towards([[0, -1, 1], [0.3, -0.9, 0.2], [1, 0.4, 0.5], [-0.2, 1, 0.05], [0, 0, 1]])


def tilted_square(tilt):
    """A unit square that looks south, raised above the ground, so that nothing stands in front of
    it.
    """
    turn = np.radians(tilt)
    return scene_of_triangles(
        *strip([0, 0, 5], [1, 0, 0], [0, np.cos(turn), np.sin(turn)], 1), [0, 0]
    )


def direct_relative(transfer):
    """Direct irradiance per DNI for every traced sun, put together from its three parts."""
    height = transfer.suns.direction[:, 2]
    first = (
        np.maximum(transfer.surfaces.normal @ transfer.suns.direction.T, 0) * transfer.visible_share
    )
    far_ground = np.outer(transfer.far_ground_view_factor, transfer.ground_albedo * height)
    return first + transfer.direct_reflected + far_ground


@pytest.mark.parametrize(
    ("tilt", "expected"),
    mark_cases([(0, 1.0), (30, 0.949759526), (60, 0.8125), (90, 0.625)], kept=2),
)
@pytest.mark.parametrize("way", mark_cases(WAYS, law=(0, 1)))
def test_unshaded_surface(way, tilt, expected):
    """Eq. 9 and Eq. 11 of the paper."""
    transfer = WAYS[way](tilted_square(tilt), SUNS)
    assert (transfer.record.hemisphere_rays == transfer.record.shadow_rays == 0) == (way == "plan")
    error = transfer.diffuse_relative_standard_error
    # A hemisphere that just covers the scene would give photons 1.6 % more, the far ground without
    # its albedo twice as much.
    assert error < {"plan": 1e-9, "rays": 0.005, "photons": 0.002 * expected}[way]
    assert_mean(transfer.diffuse_relative, error + 1e-7, expected)
    normal = np.array([0, -np.sin(np.radians(tilt)), np.cos(np.radians(tilt))])
    ground_view = (1 - normal[2]) / 2
    eq_11 = np.maximum(SUNS.direction @ normal, 0) + ALBEDO * ground_view * SUNS.direction[:, 2]
    allowed = {"plan": 1e-6, "rays": 0.005, "photons": 0.002}[way]
    assert direct_relative(transfer).ravel() == pytest.approx(eq_11, abs=allowed)
    assert transfer.far_ground_view_factor == pytest.approx(ground_view, abs=0.005)
    if way == "photons":
        assert transfer.direct_annual_standard_error < 0.002
        annual = direct_relative(transfer) @ SUNS.weight
        assert_mean(annual, transfer.direct_annual_standard_error + 1e-6, eq_11 @ SUNS.weight)
    else:
        assert transfer.visible_share.ravel() == pytest.approx(
            (SUNS.direction @ normal > 1e-9).astype(float)
        )


@pytest.mark.slow
@pytest.mark.parametrize(("way", "error"), [("plan", 1e-7), ("photons", 0.005)])
def test_far_ground_off_leaves_the_sky_only(way, error):
    transfer = WAYS[way](tilted_square(90), SUNS, far_ground=False)
    assert transfer.diffuse_relative == pytest.approx(0.5, abs=error)
    assert transfer.far_ground_view_factor == transfer.ground_albedo == 0
    assert (
        transfer.direct_reflected.max() < 1e-4
    )  # what chance gives photons beyond the sun's light


def canyon(strips=50, far=100.0, middle=10.0):
    """Street canyon H = W = 1 along x: its middle part is what counts, long ends keep the ends
    away.

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
        names += [
            f"{part}{'' if start == -middle else ' end'}" for part in ("ground", "wall", "wall")
        ]
    scene = join(parts)
    name_of = np.repeat(names, 2 * strips)
    return scene, np.flatnonzero(name_of == "ground"), np.flatnonzero(name_of == "wall")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("trace", "bounces"),
    mark_cases(
        [
            *((run_gather, bounces) for bounces in range(4)),
            *((run_forward, bounces) for bounces in range(4)),
        ],
        kept=1,
        law=(3, 5),
    ),
)
def test_street_canyon(trace, bounces):
    """Mean over wall and ground of the canyon H/W = 1 after 0 to 3 reflections against numeric
    radiosity.

    Photons are counted at their own place, so nothing need be split for them. The error is small
    enough to tell each reflection from the one before: 0.06, 0.009 and 0.0014.
    """
    known = canyon_after_bounces(1, 1, ALBEDO, bounces)
    assert known[0][-1] == pytest.approx(
        (0.292893, 0.353350, 0.362375, 0.363992)[bounces], abs=2e-6
    )
    assert known[1][-1] == pytest.approx(
        (0.414214, 0.451931, 0.461190, 0.462563)[bounces], abs=2e-6
    )
    scene, ground, wall = canyon() if trace is run_gather else canyon(strips=1, middle=60.0)
    samples, largest = {run_gather: (4096, 4e-4), run_forward: (20_000, 0.0015)}[trace]
    if trace is run_forward and bounces == 3:
        samples, largest = 400_000, 3.4e-4
    transfer = trace(
        scene, suns_towards([[0, 0, 1]]), max_bounces=bounces, samples=samples, far_ground=False
    )
    for chosen, value in ((wall, known[0][-1]), (ground, known[1][-1])):
        area = scene.surfaces.area[chosen]
        mean = np.average(transfer.diffuse_relative[chosen], weights=area)
        error = (
            np.sqrt(((area * transfer.diffuse_relative_standard_error[chosen]) ** 2).sum())
            / area.sum()
        )
        assert error < largest
        assert_mean(mean, error, value)
