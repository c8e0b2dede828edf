"""The pilot of the plan below crowns and within terrain, against closed forms."""

import numpy as np
import pytest
from leaves import box, crowns_of
from scenes import scene_of_triangles, strip, suns_towards
from scipy.special import expn

from citypv.core.effects.pilot import trace_pilot
from citypv.core.horizon.horizon import STEPS, TerrainHorizon
from citypv.core.patches.facing_scene import FacingScene
from citypv.core.patches.patches import patches_of_scene
from citypv.core.photons.specular_light import Surroundings
from citypv.core.trees.canopy import Canopy

DEPTH = 0.7  # optical depth of the layer of leaves
ZENITH, LOW = [0.0, 0.0, 1.0], [0.0, 1.0, 0.1]


def plane(albedo=0.0):
    scene = scene_of_triangles(*strip([-1, -1, 0], [2, 0, 0], [0, 2, 0], 1))
    return scene, patches_of_scene(scene, np.full(len(scene.triangles), albedo, np.float32), 1)


def look(scene, patches, suns, canopy=None, terrain=None):
    return trace_pilot(FacingScene(scene, patches), patches, scene, Surroundings(0.0, suns, canopy, terrain), 5)


def layer():
    """Leaves between heights of 1 and 2 m, practically to the horizon."""
    return Canopy(crowns_of(box((-1e4, -1e4, 1), (1e4, 1e4, 2))), np.array([DEPTH]), np.zeros(1))


def test_below_a_layer_of_leaves():
    """Of an isotropic sky 2 E₃(τ), of a sun in the zenith exp(-τ)."""
    pilot = look(*plane(), suns_towards([ZENITH]), canopy=layer())
    sky = pilot.sky[:, 0].astype(float)
    # Each path finds what passes on its own way: its standard deviation is below a half.
    assert pilot.weight @ sky == pytest.approx(2 * expn(3, DEPTH), abs=4 * sky.std() / np.sqrt(len(sky)))
    assert np.allclose(pilot.sun[:, 0], np.exp(-DEPTH), atol=1e-5)


def test_leaves_beyond_what_a_ray_meets_take_nothing():
    """Light in a gap of 2 m comes in from the sides: leaves on top of the gap's roof do not weaken it."""
    ground = strip([-50, -50, 0], [100, 0, 0], [0, 100, 0], 1)
    roof = strip([-50, -50, 2], [0, 100, 0], [100, 0, 0], 1)
    scene = scene_of_triangles(
        np.concatenate([ground[0], roof[0]]), np.concatenate([ground[1], roof[1] + len(ground[0])])
    )
    patches = patches_of_scene(scene, np.full(len(scene.triangles), 0.5, np.float32), 1)
    crown = Canopy(crowns_of(box((-45, -45, 3), (45, 45, 9))), np.array([DEPTH]), np.zeros(1))
    bare, leafy = (look(scene, patches, None, canopy) for canopy in (None, crown))
    assert np.array_equal(bare.sky, leafy.sky)
    assert bare.sky[:, 2:].any()


@pytest.mark.parametrize("height", [10.0, 35.0])
def test_within_a_ring_of_mountains(height):
    """A level surface sees cos² h of the sky above a horizon of height h, and no sun below it."""
    terrain = TerrainHorizon(np.full(STEPS, height))
    pilot = look(*plane(), suns_towards([ZENITH, LOW]), terrain=terrain)
    sky = pilot.sky[:, 0].astype(float)
    expected = np.cos(np.radians(height)) ** 2
    assert pilot.weight @ sky == pytest.approx(expected, abs=4 * sky.std() / np.sqrt(len(sky)))
    assert set(np.unique(pilot.sun[:, 0])) == {0.0, 1.0}
