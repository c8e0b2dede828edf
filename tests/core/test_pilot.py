"""What the pilot of `citypv accuracy` traces, and of which surfaces it tells errors."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from small_city import write_small_city

from citypv.core.accuracy import time_patches
from citypv.core.accuracy.pilot import choose_neighbourhood
from citypv.core.accuracy.pilot_run import RUNS, PilotRun, share_work, trace_part
from citypv.core.accuracy.predict import wall_of
from citypv.core.accuracy.time_patches import BLOCK, draw_patches
from citypv.core.energy.compute_energy import compute_energy
from citypv.core.light.prepare_scene import build_tree, prepare_scene
from citypv.core.request import Request
from citypv.core.selfcheck.plain_scenes import join_parts
from citypv.core.study import read_scene, read_year
from citypv.core.sun.choose_suns import choose_suns

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
    square, counted = choose_neighbourhood(tiled, 1800, 800)
    middle = np.asarray(tiled.scene.vertices, float)[tiled.scene.triangles].mean(axis=1)[:, :2]
    away = np.abs(middle - SIDE / 2).max(axis=1)
    for chosen, count in ((square, 1800), (counted[tiled.scene.triangle_surface], 800)):
        side = SIDE * np.sqrt(count / (2 * SIDE**2))
        assert (away[chosen] < side / 2 + 1).all()
        assert chosen[away < side / 2 - 1].sum() >= (away[:-1] < side / 2 - 1).sum()
    assert not (counted & ~square).any()


def test_of_a_middle_without_eligible_surfaces_the_whole_square_counts(tiled):
    eligible = np.isin(np.arange(len(tiled.scene.surfaces)), (0, 2 * SIDE**2 - 1))  # in opposite corners
    surfaces = replace(tiled.scene.surfaces, eligible=eligible)
    square, counted = choose_neighbourhood(replace(tiled, scene=replace(tiled.scene, surfaces=surfaces)), 1800, 100)
    assert np.array_equal(counted[tiled.scene.triangle_surface], square)


def test_of_a_small_city_all_surfaces_count(tiled):
    square, counted = choose_neighbourhood(tiled, 10_000, 4_000)
    assert square.all() and counted.all()


def test_patches_are_drawn_in_blocks_from_the_whole_city(tiled):
    drawn = np.flatnonzero(draw_patches(tiled, 640, 1))
    assert 640 - BLOCK <= len(drawn) <= 640
    ends = np.flatnonzero(np.diff(drawn) > 1)
    assert len(ends) < len(drawn) / BLOCK
    assert drawn.min() < SIDE**2 / 2 and drawn.max() > 1.5 * SIDE**2


def test_hours_of_counted_surfaces_are_those_of_the_whole_city(tmp_path):
    """Few surfaces are computed by pvlib itself, many by tables that are right to 0.01 %."""
    request = Request(weather="clear-sky", threads=1, patch_size=None)
    scene = read_scene([write_small_city(tmp_path / "small.gml")], request)
    weather = read_year(scene.site, request)
    suns = choose_suns("days:4", *weather.axis, request.seed, position=weather.data)
    prepared = build_tree(prepare_scene(scene, request, weather=weather), request)
    counted = np.arange(len(scene.surfaces)) % 3 == 0
    every = np.ones(len(prepared.patches), bool)
    run, transfer = trace_part((scene, prepared, weather, request, suns), every, RUNS["C"], counted)
    whole = compute_energy(transfer, weather, threads=1, sky="isotropic" if not transfer.sources else "perez")
    assert counted[run.errors.rows].all() and len(run.errors.rows) > 2
    assert run.errors.hours == pytest.approx(whole.full_load_hours[run.errors.rows], rel=2e-4)
    assert run.errors.area == pytest.approx(whole.counted_area[run.errors.rows])


def test_other_work_during_one_run_of_each_does_not_count(monkeypatch):
    """Each run is traced twice; one of the two takes three times as long, of every second run the first."""
    true, traced = {"A": 4.0, "B": 3.0, "C": 1.0}, []

    def trace_task(task, suns):
        traced.append(task)
        slow = 3.0 if (traced.count(task) == 1) == (task == "B") else 1.0
        stages = {"sky": slow * true[task], "suns": slow * 2 * true[task]}
        walls = {stage: 0.5 * took for stage, took in stages.items()}
        run = PilotRun(256, 16, 3, suns, (0, 0), 0.1, walls, stages, (0.1 * slow, 0.2 * slow), None, 0.0)
        return run, None

    monkeypatch.setattr(time_patches, "trace_task", trace_task)
    runs = dict(zip(true, time_patches.time_tasks(list(true), 12), strict=True))
    assert all(first != second for first, second in pairwise(traced))
    for name, run in runs.items():
        assert run.processor_seconds == {"sky": true[name], "suns": 2 * true[name]}
        assert run.seconds == {"sky": 0.5 * true[name], "suns": true[name]}
        assert run.main_seconds == (0.1, 0.2)


def test_wall_time_is_that_of_threads_that_have_work():
    """Rays come in tasks of 2¹⁸, points of 2¹⁴: of 3,640 patches 4 tasks of 256 rays, one of 64, 4 of 16 points."""
    run = PilotRun(256, 16, 3, 12, (3640, 0), 0.1, {}, {}, (0.1, 0.2), None, 0.0, threads=2)
    assert share_work(run) == (1.0, 1.0)
    assert share_work(replace(run, samples=64, shadow_samples=4)) == (0.5, 1.0)  # points: no task of more than a half
    assert share_work(replace(run, counts=(3000, 0))) == (0.75, 0.75)  # 3 tasks, the last one alone
    assert share_work(replace(run, threads=16)) == (0.25, 1.0)
    # One task of 2 s, and 0.1 s of the main thread: two threads would have taken half of it.
    one = replace(run, samples=64, shared=(0.5, 1.0), processor_seconds={"sky": 2.1, "suns": 3.2})
    assert wall_of([replace(one, seconds={"sky": 2.1, "suns": 2.9})]) == pytest.approx(0.5)
    assert wall_of([replace(one, seconds={"sky": 2.7, "suns": 2.0})]) == pytest.approx(1.8 / 3.0)
    assert wall_of([replace(one, seconds={"sky": 0.5, "suns": 0.5})]) == 0.5  # no less than all threads at work
