"""Hard cases for photons: what breaks rays from faces may break rays onto them in its own way."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import RUNS, join, run_forward, run_gather, scene_of_triangles, strip, suns_towards
from thorough import mark_cases
from towns import spun

from citypv.core.commands.plain_scenes import box

SUNS = suns_towards([[0.3, -0.8, 0.6], [-0.5, 0.6, 0.4], [0, 0, 1]])
PLAIN = strip([-60, -60, 0], [120, 0, 0], [0, 120, 0], 6)
HOUSE = box((-5, -5, 0), (5, 5, 10))
SOUTH, EAST = slice(16, 18), slice(20, 22)  # walls of the house behind the plain's twelve triangles


def trace(parts, suns=SUNS, **settings):
    scene = parts if hasattr(parts, "triangles") else join(parts)
    return run_forward(scene, suns, **{"samples": 2000} | settings)


def gathered(parts, **settings):
    return run_gather(join(parts), SUNS, **{"samples": 4096, "shadow_samples": 256} | settings)


def agree(one, other, chosen=slice(None), z=4.5):
    """Diffuse light of gather and forward, surface by surface."""
    error = np.hypot(one.diffuse_relative_standard_error, other.diffuse_relative_standard_error)[
        chosen
    ]
    difference = np.abs(one.diffuse_relative - other.diffuse_relative)[chosen]
    assert (difference <= z * error + 0.004).all(), (difference, error)


def direct_of(transfer):
    """First hits and reflections, per sun."""
    normal, direction = transfer.surfaces.normal, transfer.suns.direction
    return np.maximum(normal @ direction.T, 0) * transfer.visible_share + transfer.direct_reflected


# Geometry


@pytest.mark.slow
@pytest.mark.parametrize("away", [0.0, 1e4])
def test_an_unshaded_face_gets_its_closed_form_at_every_incidence(away):
    """A face turned any way, suns down to 0.1° above its plane: per irradiance on it, 1."""
    turn = spun(np.random.default_rng(3))
    angle, around = (
        grid.ravel()
        for grid in np.meshgrid(np.radians([90, 10, 1, 0.1]), np.radians(range(0, 360, 30)))
    )
    local = np.column_stack(
        [np.cos(angle) * np.cos(around), np.cos(angle) * np.sin(around), np.sin(angle)]
    )
    directions = local @ turn.T
    directions = directions[directions[:, 2] > 1e-3]
    points, faces = strip([-5, -5, 0], [10, 0, 0], [0, 10, 0], 2)
    scene = scene_of_triangles(points @ turn.T + [away, -away, 50], faces, np.zeros(4, int))
    transfer = trace(scene, suns_towards(directions), samples=8000, max_bounces=0, far_ground=False)
    share = direct_of(transfer)[0] / (transfer.surfaces.normal[0] @ directions.T)
    assert len(directions) > 15
    steep = transfer.surfaces.normal[0] @ directions.T > 0.1
    assert share[steep] == pytest.approx(1, abs=0.02)
    assert share[~steep] == pytest.approx(1, abs=0.35)  # fewer photons
    assert share.mean() == pytest.approx(1, abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("depth", [0.5, 5.0])
def test_walls_that_go_on_below_the_ground(depth):
    """The far ground shines from below the horizon, but not from below the ground."""
    parts = [PLAIN, *box((-5, -5, -depth), (5, 5, 10))]
    transfer = trace(parts, samples=8000, max_bounces=1)
    assert transfer.record.photons["far ground"]["covered"] > 0
    known = gathered(parts, max_bounces=1)
    walls = slice(16, 24)
    # The line of the ground runs through cells of the patches; both estimators ask the same cells.
    one, other = (side.far_ground_view_factor[walls].mean() for side in (known, transfer))
    assert other == pytest.approx(one, abs=0.01)
    share = 10 / (10 + depth)
    assert other < 0.5 * share
    assert transfer.sky_view_factor[walls].mean() == pytest.approx(0.5 * share, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("missing", [0, 1, 2])
def test_an_open_house(missing):
    """Without its roof, its floor or a wall, its other faces get what they get in gather."""
    parts = [PLAIN, *(face for number, face in enumerate(HOUSE) if number != missing)]
    agree(
        gathered(parts, max_bounces=1), trace(parts, max_bounces=1, samples=4000), slice(12, None)
    )


@pytest.mark.slow
def test_an_inverted_house_is_dark_outside():
    parts = [PLAIN, *((points, np.asarray(faces)[:, ::-1]) for points, faces in HOUSE)]
    transfer = trace(parts)
    assert transfer.diffuse_relative[12:].max() == transfer.visible_share[12:].max() == 0
    assert transfer.diffuse_relative[:12].max() > 0.9


@pytest.mark.slow
def test_a_face_that_leans_out_over_another_and_one_that_looks_down():
    parts = [
        PLAIN,
        strip([-10, 0, 8], [20, 0, 0], [0, -6, 0.5], 1),
        strip([-10, 0, 0], [20, 0, 0], [0, 0, 8], 1),
    ]
    agree(gathered(parts), trace(parts, samples=6000), slice(12, None))


def test_slivers():
    scene = join([strip([0, 0, 5], [100, 0, 0], [0, 2e-3, 0], 20)])
    transfer = trace(scene, samples=400, max_bounces=0)
    assert transfer.diffuse_relative.mean() == pytest.approx(1, abs=0.03)
    assert direct_of(transfer).mean(axis=0) == pytest.approx(SUNS.direction[:, 2], rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1e-3, 1024.0, 1e3])
def test_any_scale(scale):
    """The same photons enter a town of any size: by powers of two to the last bit, else but for
    rounding.
    """
    parts = [PLAIN, *HOUSE]
    one, other = trace(parts), trace([(points * scale, faces) for points, faces in parts])
    for name in ("diffuse_relative", "visible_share", "direct_reflected"):
        limit = 1e-12 if scale == 1024 else 2e-3
        assert getattr(other, name) == pytest.approx(getattr(one, name), abs=limit), name


# Light


@pytest.mark.slow
@pytest.mark.parametrize(
    ("albedo", "bounces"), mark_cases([(0.0, 1), (1.0, 0), (1.0, 50)], law=(1,))
)
def test_nothing_is_brighter_than_the_sky(albedo, bounces):
    """White furnace: where all reflects all, everything comes as near to 1 as its error says;
    nothing is beyond.
    """
    transfer = trace([PLAIN, *HOUSE], albedo=albedo, ground_albedo=albedo, max_bounces=bounces)
    error = transfer.diffuse_relative_standard_error
    assert np.isfinite(error).all()
    assert (transfer.diffuse_relative <= 1 + 4.5 * error).all()
    if bounces == 50:
        lit = np.r_[12:14, 16:24]
        assert (transfer.diffuse_relative[lit] >= 0.99 - 4.5 * error[lit]).all()


@pytest.mark.parametrize("estimator", RUNS)
def test_no_triangle(estimator):
    scene = join([PLAIN])
    surfaces = {
        name: values[:0] for name, values in vars(scene.surfaces).items() if values is not None
    }
    rows = {
        name: getattr(scene, name)[:0] for name in ("vertices", "triangles", "triangle_surface")
    }
    rows |= {name: getattr(scene, name)[:0] for name in ("footprint", "closure")}
    transfer = RUNS[estimator](
        replace(scene, surfaces=replace(scene.surfaces, **surfaces), **rows), SUNS
    )
    assert transfer.visible_share.shape == (0, 3)
    assert transfer.diffuse_relative.shape == (0,)
    assert estimator == "gather" or transfer.record.photons["sky"]["emitted"] == 0


@pytest.mark.thorough
def test_ten_million_photons_lose_nothing():
    """Sums are exact: all that was emitted is found again to the last photon, and an unshaded face
    gets its 1.
    """
    scene = scene_of_triangles([[0, 0, 5], [3, 0, 5], [0, 2, 5]], [[0, 1, 2]])
    transfer = trace(scene, suns_towards([[0, 0, 1]]), samples=10_000_000, max_bounces=0)
    for name in ("sky", "suns"):
        tally = transfer.record.photons[name]
        assert tally["emitted"] == 10_000_000
        assert sum(tally.values()) == 2 * tally["emitted"]
    assert transfer.diffuse_relative == pytest.approx(1, abs=1e-4)
    assert transfer.visible_share == pytest.approx(1, abs=1e-4)
