"""What the pilot traces, of which surfaces it tells errors, and how its costs are fitted."""

from dataclasses import replace

import numpy as np
import pytest
from small_city import write_small_city

from citypv.core.accuracy.pilot import (
    RUNS,
    CityYear,
    PilotRun,
    average_errors,
    choose_neighbourhood,
    count_city,
    count_patches,
    fit_costs,
    tell_errors,
    terms_before_suns,
    terms_of_suns,
    trace_part,
)
from citypv.core.accuracy.yield_errors import YieldErrors
from citypv.core.commands.plain_scenes import join_parts
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.energy.pv_system import build_system
from citypv.core.light.prepare_scene import build_tree, prepare_scene
from citypv.core.settings.request import Request
from citypv.core.study import read_scene, read_year, trace_scene
from citypv.core.sun.sun_sampling import choose_suns

SIDE = 40  # tiles of a metre


@pytest.fixture(scope="module")
def tiled():
    """A level square of tiles, each of two triangles, below a roof that shades all of them: PreparedScene."""
    x, y = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    corner = np.stack([x.ravel(), y.ravel(), np.zeros(SIDE**2)], axis=1).astype(float)
    points = (corner[:, None] + [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]).reshape(-1, 3)
    faces = (4 * np.arange(SIDE**2)[:, None, None] + [[0, 1, 2], [0, 2, 3]]).reshape(-1, 3)
    roof = np.array([[0, 0, 5], [SIDE, 0, 5], [0, SIDE, 5]], float)
    request = Request(ground="none", patch_size=None)
    scene = join_parts([(points, faces), (roof, np.array([[0, 2, 1]]))])
    scene.surfaces.eligible[:] = True
    return prepare_scene(scene, request)


def test_errors_are_told_of_the_inner_part_of_a_square(tiled):
    """Of n tiles, k patches about the middle lie in a square of the side times √(k / 2n)."""
    square, counted = choose_neighbourhood(tiled, 1600)
    middle = np.asarray(tiled.scene.vertices, float)[tiled.scene.triangles].mean(axis=1)[:, :2]
    away = np.abs(middle - SIDE / 2).max(axis=1)
    for chosen, count in ((square, 1600), (counted[tiled.scene.triangle_surface], 800)):
        side = SIDE * np.sqrt(count / (2 * SIDE**2))
        assert (away[chosen] < side / 2 + 1).all()
        assert chosen[away < side / 2 - 1].sum() >= (away[:-1] < side / 2 - 1).sum()
    assert not (counted & ~square).any()


def test_of_a_middle_without_eligible_surfaces_the_whole_square_counts(tiled):
    eligible = np.isin(np.arange(len(tiled.scene.surfaces)), (0, 2 * SIDE**2 - 1))  # in opposite corners
    surfaces = replace(tiled.scene.surfaces, eligible=eligible)
    square, counted = choose_neighbourhood(replace(tiled, scene=replace(tiled.scene, surfaces=surfaces)), 1800)
    assert np.array_equal(counted[tiled.scene.triangle_surface], square)


def test_of_a_small_city_all_surfaces_count(tiled):
    square, counted = choose_neighbourhood(tiled, 10_000)
    assert square.all() and counted.all()


def test_hours_and_patches_are_those_of_the_whole_city(tmp_path):
    """Few surfaces are computed by pvlib itself, many by tables that are right to 0.01 %."""
    request = Request(weather="clear-sky", threads=1, patch_size=5.0)
    scene = read_scene([write_small_city(tmp_path / "small.gml")], request)
    weather = read_year(scene.site, request)
    suns = choose_suns("days:4", *weather.axis, position=weather.data)
    prepared = build_tree(prepare_scene(scene, request, weather=weather), request)
    counted = np.arange(len(scene.surfaces)) % 3 == 0
    every, inputs = np.ones(len(prepared.patches), bool), CityYear(scene, prepared, weather, request)
    run, transfer, part = trace_part(inputs, every, RUNS["coarse"], suns)
    errors = tell_errors(transfer, inputs, counted, part.surfaces)
    whole = compute_energy(
        transfer, weather, build_system(request), threads=1, sky="isotropic" if not transfer.sources else "perez"
    )
    assert counted[errors.rows].all() and len(errors.rows) > 2
    assert errors.hours == pytest.approx(whole.full_load_hours[errors.rows], rel=2e-4)
    assert errors.area == pytest.approx(whole.counted_area[errors.rows])
    # From half of the city: how many patches of all a run traces, and how many of the ground.
    half, _ = choose_neighbourhood(prepared, len(every) // 2)
    run, _, _ = trace_part(inputs, half, RUNS["fine"], suns)
    rays = trace_scene(scene, weather, request, prepared=prepared).record.hemisphere_rays
    assert count_city(prepared, half, run.counts) == pytest.approx(
        count_patches(prepared.patches, prepared.plan, rays, request.samples), rel=0.15
    )


def test_costs_are_found_from_runs_that_follow_the_formula():
    """Also those of a run of other patches, rays, points, reflections and suns."""
    runs = [
        PilotRun(*setting, 144, counts, (), 0.0, 0.0)
        for setting, counts in (
            ((256, 16, 3), (64, 0)),
            ((64, 4, 1), (900, 300)),
            ((64, 16, 3), (900, 300)),
            ((256, 16, 3), (900, 350)),
        )
    ]
    other = PilotRun(1024, 64, 5, 600, (8000, 2000), (), 0.0, 0.0)
    for terms, costs in ((terms_before_suns, [2e-2, 1e-5, 3e-7]), (terms_of_suns, [3e-4, 1e-8, 2e-10])):
        found = fit_costs(np.array([terms(run) for run in runs]), np.array([terms(run) @ costs for run in runs]))
        assert terms(other) @ found == pytest.approx(terms(other) @ costs, rel=1e-6)


def test_errors_of_several_seeds_are_averaged_over_the_surfaces_that_all_have():
    def made(rows, variance):
        count = len(rows)
        return YieldErrors({"rays": np.full(count, variance)}, np.full(count, 9.0), np.ones(count), 1, np.array(rows))

    found = average_errors([made([1, 2, 5], 1.0), made([2, 5, 7], 3.0)])
    assert found.rows.tolist() == [2, 5] and found.variance["rays"].tolist() == [2.0, 2.0]
