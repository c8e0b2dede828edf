"""What must not change a result, and what must."""

import numpy as np
import pytest
from scenes import join, run_gather, strip, suns_towards

from citypv.core.commands.plain_scenes import box

SUNS = suns_towards([[0.2, -0.5, 1], [0.7, 0.7, 0.6], [-0.8, 0.1, 0.3]])


def three_houses():
    ground = strip([-40, -40, 0], [80, 0, 0], [0, 80, 0], 6)
    houses = (
        box((-10, -10, 0), (0, 0, 12)) + box((4, -8, 0), (12, 2, 20)) + box((-6, 8, 0), (9, 16, 6))
    )
    return join([ground, *houses])


def test_albedo_zero_needs_no_matrix():
    scene = three_houses()
    transfer = run_gather(scene, SUNS, albedo=0, ground_albedo=0)
    assert transfer.record.max_bounces == 0
    assert transfer.direct_reflected.max() == 0
    assert transfer.diffuse_relative == pytest.approx(transfer.sky_view_factor, abs=1e-6)


def test_without_obstacles_every_patch_has_its_closed_form():
    """Both effects off: the sky view of the tilt, and every sun in front; the far ground reflects;
    not a single ray.
    """
    scene = three_houses()
    transfer = run_gather(scene, SUNS, effects={"sky-rays": False, "shadow-rays": False})
    normal = scene.surfaces.normal
    # Floors see nothing.
    expected = np.where(normal[:, 2] > -0.5, (1 + normal[:, 2] + 0.25 * (1 - normal[:, 2])) / 2, 0)
    assert transfer.sky_view_factor == pytest.approx((1 + normal[:, 2]) / 2, abs=1e-6)
    assert transfer.diffuse_relative == pytest.approx(expected, abs=1e-6)
    in_front = normal.astype(np.float32) @ SUNS.direction.astype(np.float32).T > 0
    assert np.array_equal(transfer.visible_share > 0.5, in_front)
    assert transfer.record.hemisphere_rays == transfer.record.shadow_rays == 0
    state = {effect["key"]: (effect["on"], effect["bound"]) for effect in transfer.record.effects}
    assert state["sky-rays"] == state["shadow-rays"] == (False, None)


@pytest.mark.slow
def test_shadows_off_leave_the_sky_as_it_is():
    scene = three_houses()
    on, off = (run_gather(scene, SUNS, effects=effects) for effects in ({}, {"shadow-rays": False}))
    assert np.array_equal(on.sky_view_factor, off.sky_view_factor)
    # Without rays what is covered is known by cells, with them by the points that are looked from.
    assert (off.visible_share >= on.visible_share - on.covered_share[:, None]).all()
    assert (off.visible_share >= on.visible_share)[on.covered_share == 0].all()
    assert off.record.shadow_rays == 0 < on.record.shadow_rays
