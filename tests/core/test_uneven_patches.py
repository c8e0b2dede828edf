"""Patches are split where light that is uneven over them matters, and nowhere else."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from radiosity import crossed_strings
from scenes import join, strip, suns_towards
from small_city import write_small_city

from citypv.core.commands.simulate import simulate
from citypv.core.errors import InputError
from citypv.core.progress import silent
from citypv.core.radiosity.measure_unevenness import measure_unevenness
from citypv.core.radiosity.trace_gather import trace_gather
from citypv.core.request import Request, check_request
from citypv.core.scene.refine import refine_triangles
from citypv.core.split_uneven_patches import COARSEST, FINEST, choose_halvings, refine_patches, split_uneven_patches

TURNS = 2.4 * np.arange(60)  # [rad] golden steps
SUNS = suns_towards(np.column_stack([np.cos(TURNS), np.sin(TURNS), np.linspace(0.05, 2.0, 60)]))  # all over the sky
HEIGHT, WIDTH, LENGTH = 20.0, 20.0, 3000.0  # [m] of a wall and of the ground before it, as long as the wall


def wall_and_ground():
    """A wall that looks east over the ground before it: squares, each of one triangle at the wall and one away."""
    count = round(LENGTH / WIDTH)
    wall = strip([0, 0, 0], [0, 0, HEIGHT], [0, LENGTH, 0], count)
    return join([(wall[0], wall[1][:, ::-1]), strip([0, 0, 0], [WIDTH, 0, 0], [0, LENGTH, 0], count)]), 2 * count


def gain_of_even_ground(squares=400):
    """What the endless wall gains of its reflected light if the triangles of a square hand on their light evenly.

    The ground at x sees the sky but for the wall, and counts by the wall's view of it (crossed strings).
    Both depend on x alone, so a cell counts by how long it is along the wall at each x.

    Returns
    -------
    at_wall, away : float
    """
    edge = np.linspace(0, 1, squares + 1)
    x = 0.5 * (edge[1:] + edge[:-1])
    sky = 0.5 * (1 + x * WIDTH / np.hypot(x * WIDTH, HEIGHT))
    seen = np.array(
        [abs(crossed_strings((0, HEIGHT), (0, 0), (a * WIDTH, 0), (b * WIDTH, 0))) for a, b in pairwise(edge)]
    )
    # Of the four cells one has the tip, three share the other half of the width; one of these stands on its head.
    tip, head, side = np.where(x < 0.5, [x, 0 * x, 0 * x], [0 * x, 1 - x, x - 0.5])
    cells = [tip, head, side, side]
    assert np.allclose(np.sum(cells, axis=0), x)
    assert np.allclose([cell.mean() for cell in cells], 1 / 8, rtol=0.02)
    gains, reflected = [], 0.0
    for lengths in (cells, [cell[::-1] for cell in cells]):
        whole = np.sum(lengths, axis=0)
        mean = (whole * sky).sum() / whole.sum()
        reflected += mean * (whole * seen).sum()
        gains.append(sum((mean - (cell * sky).sum() / cell.sum()) * (cell * seen).sum() for cell in lengths))
    away, at_wall = np.array(gains) / reflected
    return at_wall, away


def test_unevenness_is_that_of_the_closed_form():
    """Four times the rays' error; the ends of the wall make 1 %."""
    scene, first_of_ground = wall_and_ground()
    at_wall, away = gain_of_even_ground()
    assert at_wall > 1.3 * away > 0.01
    request = Request(max_bounces=1, far_ground=False)
    found = np.array([sums_of_triangles(scene, replace(request, seed=seed), first_of_ground) for seed in range(4)])
    assert found[:, :, 0].mean(axis=0) == pytest.approx(0, abs=1e-12)  # nobody sees the wall
    for column, known in ((1, at_wall), (2, away)):
        values = found[:, :, column].ravel()
        error = values.std(ddof=1) / np.sqrt(len(values))
        assert error < 0.04 * at_wall
        assert abs(values.mean() - known) < 4 * error + 0.01 * at_wall


def sums_of_triangles(scene, request, first_of_ground):
    """Sums over the wall, the ground's triangles at the wall and those away from it: (HALVES, 3)."""
    gain = measure_unevenness(scene, request, silent)
    middle = scene.vertices[scene.triangles].mean(axis=1)
    ground = np.arange(len(gain)) >= first_of_ground
    parts = (~ground, ground & (middle[:, 0] < WIDTH / 2), ground & (middle[:, 0] > WIDTH / 2))
    return np.stack([gain[part].sum(axis=0) for part in parts], axis=1)


def test_refining_to_own_sizes_leaves_no_gap():
    """Neighbours of what is split are split along the shared edge: every edge has two sides, or lies on the rim."""
    scene, _ = wall_and_ground()
    size = np.full(len(scene.triangles), 100.0)
    size[[3, 4, 250, 400]] = 1.5, 6.0, 0.7, 3.0
    vertices, triangles, parent = refine_triangles(scene.vertices, scene.triangles, size)
    corners = vertices[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    assert (longest <= 1.00001 * size[parent]).all()
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert np.bincount(parent, area) == pytest.approx(scene.surfaces.area)
    # The rim stays as long as it was: what has one side only is no gap between pieces.
    assert rim_length(vertices, triangles) == pytest.approx(rim_length(scene.vertices, scene.triangles))
    untouched = np.bincount(parent) == 1
    assert untouched.mean() > 0.9


def rim_length(vertices, triangles):
    """[m] of edges with one side only."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    single, sides = np.unique(edges, axis=0, return_counts=True)
    single = single[sides == 1]
    return np.linalg.norm(vertices[single[:, 0]] - vertices[single[:, 1]], axis=1).sum()


def test_one_size_for_all_is_the_size_of_each():
    scene, _ = wall_and_ground()
    one, each = (
        refine_triangles(scene.vertices, scene.triangles, size) for size in (7.0, np.full(len(scene.triangles), 7.0))
    )
    for a, b in zip(one, each, strict=True):
        assert np.array_equal(a, b)


@pytest.mark.parametrize("size", [0.0, -1.0, np.nan])
def test_sizes_that_are_none_are_refused(size):
    scene, _ = wall_and_ground()
    with pytest.raises(InputError, match="patch_size: row 2"):
        refine_triangles(scene.vertices, scene.triangles, np.where(np.arange(len(scene.triangles)) == 2, size, 5.0))


def test_errors_are_halved_at_the_least_cost():
    """Two classes of patches, by trying every pair of halvings."""
    error = np.repeat([4.0, 0.1], [10, 200])
    left, longest = np.stack([error, error], axis=1), np.full(210, 20.0)
    for asked in (50.0, 21.0, 12.0, 8.0):
        halvings, expected = choose_halvings(left, longest, asked)
        patches = (4.0**halvings).sum()
        assert expected == pytest.approx((error / 2.0**halvings).sum())
        assert expected <= asked
        pairs = [10 * 4**a + 200 * 4**b for a in range(4) for b in range(4) if 40 / 2**a + 20 / 2**b <= asked]
        assert patches <= 1.0001 * min(pairs)
    halvings, expected = choose_halvings(left, longest, 1e-3)
    assert (longest / 2.0**halvings >= FINEST).all()
    assert expected == pytest.approx(60 / 8)


def test_noise_of_the_pilot_is_not_taken_for_a_gain():
    """The choice by what was measured looks better than it is; what is expected of it is what is left in truth."""
    random = np.random.default_rng(5)
    true = random.exponential(1.0, 20_000) ** 3
    left = true[:, None] + random.normal(0, 40, (20_000, 2))
    asked = 0.6 * true.sum()
    halvings, expected = choose_halvings(left, np.full(20_000, 20.0), asked)
    remains = (true / 2.0**halvings).sum()
    by_the_same = (left.mean(axis=1) / 2.0**halvings).sum()
    assert expected <= asked
    assert by_the_same < 0.85 * remains
    assert remains == pytest.approx(expected, rel=0.06)


def yard_with_a_canopy(length=400):
    """A yard between walls of 20 m, a canopy over a part of it, and a wide plain beyond the walls' ends."""
    count = length // 20
    above = strip([0, 0, 4], [8, 0, 0], [0, length, 0], count)
    points, faces = strip([0, 0, 3.8], [8, 0, 0], [0, length, 0], count)
    walls = [
        strip([0, 0, 0], [0, 0, 20], [0, length, 0], count),
        strip([20, length, 0], [0, 0, 20], [0, -length, 0], count),
    ]
    ground = [strip([0, 0, 0], [20, 0, 0], [0, length, 0], count)]
    ground += [strip([20 * k, length + 20, 0], [20, 0, 0], [0, 200, 0], 10) for k in range(-10, 10)]
    return join([(corners, turned[:, ::-1]) for corners, turned in walls] + [above, (points, faces[:, ::-1]), *ground])


def test_only_what_the_walls_see_unevenly_is_split():
    scene = yard_with_a_canopy()
    finer, account = split_uneven_patches(scene, Request(patch_error=0.5), silent)
    assert account["before"] > 1
    assert account["asked"] == 0.5 >= account["expected"] > 0.4
    assert account["given"] == len(scene.triangles)
    assert account["made"] == len(finer.triangles)
    middle = scene.vertices[scene.triangles].mean(axis=1)
    pieces = np.bincount(finer.triangle_surface)
    yard = (middle[:, 2] == 0) & (middle[:, 1] < 400)
    assert (pieces[yard] > 3).mean() > 0.7
    assert (pieces[middle[:, 1] > 440] == 1).all()  # of the plain
    above = (middle[:, 2] == 4) & (scene.surfaces.normal[:, 2] > 0)
    assert pieces[yard].mean() > 3 * pieces[above].mean()


@pytest.mark.slow
def test_splitting_meets_the_error_with_fewer_patches():
    """The walls' reflected light, of the sky and of suns, against patches of two metres everywhere."""
    scene, asked = yard_with_a_canopy(), 0.5
    known = reflected_of_walls(refine_patches(scene, np.full(len(scene.triangles), 2.0)), 256)
    of_one_size = refine_patches(scene, np.full(len(scene.triangles), 10.0))
    finer, _ = split_uneven_patches(scene, Request(patch_error=asked), silent)
    as_given, split = (np.abs(reflected_of_walls(patches, 4096) / known - 1) for patches in (scene, finer))
    noise = 1e-3
    assert split.max() < asked / 100 + noise
    assert as_given.mean() > max(1.5 * split.mean(), 2 * noise)
    assert len(finer.triangles) < 0.4 * len(of_one_size.triangles)


def reflected_of_walls(scene, samples):
    """Mean reflected light of all eligible surfaces: of the sky and of the suns."""
    transfer = trace_gather(scene, SUNS, Request(samples=samples, shadow_samples=max(16, samples // 64)), silent)
    area = np.where(scene.surfaces.eligible, scene.surfaces.area, 0)
    sky = transfer.diffuse_relative - transfer.sky_view_factor
    return np.array([area @ sky, area @ (transfer.direct_reflected @ SUNS.weight)]) / area.sum()


def test_threads_change_nothing():
    scene = yard_with_a_canopy()
    one, *others = (split_uneven_patches(scene, Request(patch_error=0.5, threads=t), silent) for t in (1, 2, 7))
    assert one[1]["split"] > 0
    for finer, account in others:
        assert account == one[1]
        assert np.array_equal(finer.vertices, one[0].vertices)
        assert np.array_equal(finer.triangles, one[0].triangles)


def test_where_nothing_is_reflected_nothing_is_split():
    scene = yard_with_a_canopy()
    for dark in ({"max_bounces": 0}, {"albedo": 0.0, "ground_albedo": 0.0}):
        finer, account = split_uneven_patches(scene, Request(patch_error=1e-3, **dark), silent)
        assert len(finer.triangles) == len(scene.triangles)
        assert account["before"] == account["expected"] == 0


def test_the_summary_tells_what_was_done(tmp_path):
    city = write_small_city(tmp_path / "small.gml")
    request = Request(suns="typical-days:1", patch_error=0.02)
    simulate([city], tmp_path / "out", request)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    account, budget = summary["traced"]["patches_split"], summary["error_budget"]
    assert account["made"] == summary["traced"]["patches"] > account["given"]
    assert budget["patches_asked"] == account["asked"] == 0.02
    assert budget["patches_expected"] == account["expected"] < account["before"]
    assert summary["settings"]["patch_size"] == COARSEST
    assert request.patch_size == 10.0


def test_forward_has_no_such_error():
    with pytest.raises(InputError, match="--patch-error"):
        check_request(Request(patch_error=0.5, estimator="forward"))


@pytest.mark.parametrize("error", [0.0, -1.0, np.nan])
def test_no_error_is_refused(error):
    with pytest.raises(InputError, match="--patch-error"):
        check_request(Request(patch_error=error))
