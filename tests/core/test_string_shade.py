"""Strings of modules in shade, by hand: which blocks are dark, and what a string loses by them."""

from dataclasses import replace
from itertools import chain
from types import SimpleNamespace

import numpy as np
import pvlib
import pytest
from cities import box, make_city
from scenes import scene_of_triangles, strip, suns_towards

from citypv.core.energy.pv_system import build_system
from citypv.core.energy.strings_in_shade import kept_by_strings
from citypv.core.light.prepare_scene import prepare_scene
from citypv.core.light.solve_suns import prepare_suns
from citypv.core.light.string_shade import (
    DIFFUSE_SHARES,
    LOSS_STEP,
    add_losses,
    empty_losses,
    middles_of_blocks,
    number_strings,
    table_of_strings,
)
from citypv.core.light.sun_blocks import block_of_suns
from citypv.core.light.sun_visibility import sun_visibility
from citypv.core.light.trace_all import prepare_gather, trace_all
from citypv.core.modules.lay_modules import ModuleLayout
from citypv.core.results.describe_run import describe_strings
from citypv.core.results.transfer_file import read_transfer, write_transfer
from citypv.core.results.write_summary import sum_totals
from citypv.core.run.study import (
    check_settings,
    compute_energy,
    make_located_scene,
    prepare_study,
    read_year,
    trace_scene,
)
from citypv.core.settings.errors import InputError
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request

EAST, UP = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])


def rows_on_wall(heights, count, size, *, row=None, surface=0):
    """Rows of `count` modules of a size, (width, height) [m], on a wall in the plane y = 0."""
    width, height = size
    corner = [[k * width, 0, low] for low in heights for k in range(count)]
    rows = np.repeat(np.arange(len(heights)) if row is None else row, count)
    edges = (np.tile(edge, (len(corner), 1)) for edge in (width * EAST, height * UP))
    return ModuleLayout(np.full(len(corner), surface), np.array(corner), *edges, rows)


def losses_on_wall(layout, shades, towards, *, points=1024, size=(6.0, 3.0), strips=1):
    """Losses of strings on a south wall with rectangles, (start, along, across), before it:
    (s, d).
    """
    length, height = size
    parts = [strip([length, 0, 0], height * UP, -length * EAST, strips)]
    parts += [strip(*shade, 1) for shade in shades]
    # each rectangle is a surface, the wall the first
    first = np.cumsum([0, *(len(corners) for corners, _ in parts)])
    triangles = [faces + start for (_, faces), start in zip(parts, first, strict=False)]
    own = np.repeat(np.arange(len(parts)), [len(faces) for faces in triangles])
    vertices = np.concatenate([corners for corners, _ in parts])
    scene = scene_of_triangles(vertices, np.concatenate(triangles), own)
    request, suns = Request(shadow_samples=points, max_bounces=0, samples=4), suns_towards(towards)
    context = prepare_gather(prepare_scene(scene, request, suns=suns), request, silent)
    task = prepare_suns(context, trace_all(context), suns)
    shadows, *_ = sun_visibility(task.watch, block_of_suns(suns, slice(None)))
    losses = empty_losses((len(scene.surfaces), len(suns)))
    context.layout = layout
    add_losses(table_of_strings(context, task.watch), shadows.bits, losses)
    assert not losses[1:].any()  # nothing hangs on what shades
    return losses[0] * LOSS_STEP


def lost(dark):
    """What a string loses with a share of its blocks dark: m - f, by the definition."""
    shares = np.array(DIFFUSE_SHARES)
    return (1 - dark) * (1 - shares) + shares - np.maximum(1 - dark, shares)


def test_strings_are_storeys_or_three_rows():
    """A facade of 45 m has three strings of 15 m a storey; a roof of seven rows three strings."""
    wall = rows_on_wall([0.7, 3.7, 6.7, 7.7], 45, (1.0, 0.9), row=[1, 2, 3, 3])
    string = number_strings(wall, [True])
    assert np.bincount(string).tolist() == [15] * 6 + [30] * 3
    storey, piece = string.reshape(4, 45) // 3, string.reshape(4, 45) % 3
    assert (storey == np.array([0, 1, 2, 2])[:, None]).all()
    assert (piece == np.repeat([0, 1, 2], 15)).all()
    roof = rows_on_wall(np.arange(7) * 1.7, 12, (1.0, 1.6))
    assert np.bincount(number_strings(roof, [False])).tolist() == [36, 36, 12]


def test_rows_are_counted_on_each_surface_by_themselves():
    walls = [rows_on_wall([0.7, 3.7], 5, (1.0, 1.6), surface=k) for k in (2, 5)]
    both = {n: np.concatenate([vars(wall)[n] for wall in walls]) for n in vars(walls[0])}
    string = number_strings(ModuleLayout(**both), np.ones(6, bool))
    assert np.bincount(string).tolist() == [5] * 4


def test_blocks_lie_side_by_side_along_the_short_edge():
    upright = middles_of_blocks(rows_on_wall([0], 1, (1.2, 1.8)))[0]
    assert upright == pytest.approx(np.array([[0.2, 0, 0.9], [0.6, 0, 0.9], [1.0, 0, 0.9]]))
    lying = middles_of_blocks(rows_on_wall([0], 1, (1.8, 1.2)))[0]
    assert lying == pytest.approx(np.array([[0.9, 0, 0.2], [0.9, 0, 0.6], [0.9, 0, 1.0]]))


def test_shadow_of_a_pole():
    """A post of 0.9 m before six modules darkens 3 of 18 blocks; as one before another string
    does none.
    """
    layout, south = rows_on_wall([0.5], 6, (1.0, 1.65)), [0, -1, 0.3]
    post = [1.0, -1, 0], 0.9 * EAST, 9 * UP
    assert losses_on_wall(layout, [post], south)[0] == pytest.approx(lost(3 / 18), abs=LOSS_STEP)
    # at d = 1/4, 1/2 and 3/4 it keeps 5/6 of its power: f - m by hand
    assert lost(3 / 18) == pytest.approx([7 / 8 - 5 / 6, 11 / 12 - 5 / 6, 23 / 24 - 5 / 6])
    beside = [7.0, -1, 0], 0.9 * EAST, 9 * UP
    assert losses_on_wall(layout, [beside], south)[0].max() == 0
    # behind the wall no sun is seen, and nothing is lost by strings
    assert losses_on_wall(layout, [post], [0, 1, 0.3])[0].max() == 0


@pytest.mark.parametrize(
    ("size", "edge", "dark"),
    [
        ((1.0, 1.65), 0.6, 0),  # upright: below the middles of all blocks
        ((1.0, 1.65), 1.1, 1),  # above them
        ((1.65, 1.0), 0.6, 2 / 3),  # lying: two thirds of each module
        ((1.65, 1.0), 0.3, 1 / 3),
    ],
)
def test_level_edge(size, edge, dark):
    """Shade up to a level edge takes modules that stand as a whole, and those that lie by
    thirds.
    """
    layout = rows_on_wall([0.0], 3, size)
    # The sun stands as high as it is far: the edge falls by the distance of the wall before it.
    wall = [-50, -1, 0], 100 * EAST, (1 + edge) * UP
    assert losses_on_wall(layout, [wall], [0, -1, 1])[0] == pytest.approx(lost(dark), abs=LOSS_STEP)


def hours_of(sunward, match, weight):
    """Hours with some light from the sun's place, and the suns that represent them."""
    return SimpleNamespace(
        sunward=np.full((len(match), 1), float(sunward)),
        match=np.asarray(match),
        match_weight=np.asarray(weight, float),
    )


def power_of_string(losses, visible, light, match=((0,),), weight=((1.0,),)):
    """Power over that without shade, of a surface in one hour of direct and diffuse light."""
    direct, diffuse = light
    light = np.array([[visible * direct]]), np.array([[float(diffuse)]]), np.ones((1, 1))
    steps = np.rint(np.asarray(losses) / LOSS_STEP).astype(np.uint8)[..., None]
    kept = kept_by_strings(steps, hours_of(direct, match, weight), *light)
    return kept[0, 0] * (visible * direct + diffuse) / (direct + diffuse)


@pytest.mark.parametrize(("share", "published"), [(0.10, 0.145), (0.25, 0.332), (0.50, 0.547)])
def test_half_of_the_power_where_a_third_of_the_light_goes(share, published):
    """700 W/m², of which 520 direct, on 18 blocks: within 6 points of Martínez' measured law, where
    light alone would lose half as much.
    """
    dark = np.ceil(18 * share)
    law = pvlib.shading.direct_martinez(700, 520, share, dark, 18)
    assert law == pytest.approx(published, abs=0.001)
    loss = 1 - power_of_string([lost(dark / 18)], 1 - dark / 18, (520, 180))
    assert loss == pytest.approx(dark / 18, abs=0.002)  # by hand: its dark blocks are bypassed
    assert law - 0.06 < loss < law
    assert loss > 1.3 * share * 520 / 700


def test_much_diffuse_light_is_carried_on():
    """With 180 of 280 W/m² diffuse, and three quarters dark, bypassing would lose 0.75."""
    assert power_of_string([lost(0.75)], 0.25, (100, 300)) == pytest.approx(0.75, abs=0.002)


def test_nothing_is_lost_between_a_lit_and_a_dark_day():
    """A string that is lit on one traced day and dark on the next loses by its light alone."""
    either = [lost(0.0), lost(1.0)]
    half = power_of_string(either, 0.5, (520, 180), [[0, 1]], [[0.5, 0.5]])
    assert half == pytest.approx((0.5 * 520 + 180) / 700)


def stand_houses(heights, **settings):
    """Houses in a row from south to north, 6 m apart, and the weather over them."""
    settings = {"suns": "days:2", "samples": 16, "max_bounces": 1, "threads": 1} | settings
    request = Request(weather=["clear-sky"], latitude=50.0, longitude=8.0, **settings)
    boxes = (box(f"b{k}", 0, 16 * k, 30, 10, 0, height) for k, height in enumerate(heights))
    scene = make_located_scene(make_city([*chain.from_iterable(boxes)]), request)
    return scene, read_year(scene.site, request), request


def trace_houses(heights, **settings):
    """Light of these houses, with weather and settings."""
    scene, weather, request = stand_houses(heights, **settings)
    prepared = prepare_study(scene, weather, request)
    return trace_scene(scene, weather, request, prepared=prepared), weather, request


def test_a_run_tells_what_strings_lose_and_counts_it_where_asked():
    """Hours on strings are those of single modules less what is told of either."""
    transfer, weather, request = trace_houses([9.0, 12.0])
    single, strings = (
        compute_energy(transfer, weather, replace(request, strings=one))
        for one in ("module", "string")
    )
    assert transfer.string_loss.any()
    assert strings.string_loss == pytest.approx(single.string_loss, nan_ok=True)
    counted = single.full_load_hours - single.string_loss
    assert strings.full_load_hours == pytest.approx(counted, nan_ok=True)
    # The wall that looks at the other house loses, its roof and open walls do not.
    south = [name.startswith("b1") for name in transfer.surfaces.building_id]
    south &= single.orientation == "south"
    assert 0.2 < single.string_loss[south].max() < 0.1 * single.full_load_hours[south].max()
    open_ = np.isin(single.kind, ["flat"]) | (single.orientation == "north")
    assert (single.string_loss[open_ & (single.kwp > 0)] == 0).any()
    told = describe_strings(sum_totals(transfer, single, build_system(request)))
    assert "would take a further" in told
    counting = build_system(replace(request, strings="string"))
    assert "it is counted" in describe_strings(sum_totals(transfer, strings, counting))


def test_kept_in_the_file(tmp_path):
    transfer, weather, request = trace_houses([9.0, 12.0])
    write_transfer(tmp_path / "transfer.nc", transfer)
    again = read_transfer(tmp_path / "transfer.nc")
    assert again.string_loss.dtype == np.uint8
    np.testing.assert_array_equal(again.string_loss, transfer.string_loss)
    # as a file of an earlier version, which does not have it
    early = replace(again, string_loss=None)
    energy = compute_energy(early, weather, request)
    assert np.isnan(energy.string_loss).all()
    assert "unknown" in describe_strings(sum_totals(early, energy, build_system(request)))
    with pytest.raises(InputError, match="trace the city again"):
        compute_energy(early, weather, replace(request, strings="string"))


@pytest.mark.parametrize(
    ("heights", "settings", "on", "words"),
    [
        ([9.0, 12.0], {}, True, "shade moves over them"),
        ([9.0], {"ground": "none"}, False, "nothing stands in front"),
        ([9.0, 12.0], {"layout": "area"}, None, "no modules are laid out"),
        ([9.0, 12.0], {"estimator": "forward"}, None, "photons"),
        ([9.0, 12.0], {"effects": {"string-shade": False}}, None, "switched off"),
    ],
)
def test_the_plan_has_a_reason(heights, settings, on, words):
    """Known to be nothing is not the same as unknown."""
    scene, weather, request = stand_houses(heights, **settings)
    plan = prepare_study(scene, weather, request).plan
    assert plan["string-shade"].on == bool(on)
    assert words in plan["string-shade"].reason
    assert plan.string_shade is on


@pytest.mark.parametrize(
    ("settings", "cure"),
    [
        ({"layout": "area"}, "--layout rows"),
        ({"estimator": "forward"}, "--estimator gather"),
        ({"effects": {"string-shade": False}}, "leave that out"),
    ],
)
def test_what_will_not_be_known_is_not_counted(settings, cure):
    with pytest.raises(InputError, match=cure):
        check_settings(Request(strings="string", **settings))
    check_settings(Request(strings="string"))


def test_one_house_loses_nothing():
    for ground in ("none", "auto"):
        transfer, weather, request = trace_houses([9.0], ground=ground)
        energy = compute_energy(transfer, weather, request)
        assert (energy.string_loss[energy.kwp > 0] == 0).all()


def losses_module_by_module(layout, towards, *, height, width):
    """Mean loss in an endless street at suns before a wall, each block's middle against the edge of
    the shadow: (d,).
    """
    string, middle = number_strings(layout, np.ones(1, bool)), middles_of_blocks(layout)[..., 2]
    edge = height - width * towards[:, 2] / -towards[:, 1]
    dark = [np.bincount(string, (middle < one).mean(axis=1)) for one in edge]
    return np.mean([lost(own) for own in (np.array(dark) / np.bincount(string)).ravel()], axis=0)


@pytest.mark.parametrize("size", [(1.0, 1.6), (1.6, 1.0)])
def test_a_street_module_by_module(size):
    """A level shadow edge looks ragged to few points: 16 a patch of 75 m² tell up to 1.2 % of the
    power too much, four times as many half of that, a thousand nothing.
    """
    layout = rows_on_wall([4.4, 7.4, 10.4, 13.0], int(60 / size[0]), size)
    generator = np.random.default_rng(1)
    height, azimuth = np.radians(generator.uniform([[5], [110]], [[60], [250]], (2, 200)))
    level = np.cos(height)
    towards = np.stack([level * np.sin(azimuth), level * np.cos(azimuth), np.sin(height)], axis=1)
    opposite = [-300, -12, 0], 600 * EAST, 15 * UP
    exact = losses_module_by_module(layout, towards, height=15, width=12)
    excess = [
        losses_on_wall(layout, [opposite], towards, points=points, size=(60, 15), strips=6).mean(
            axis=0
        )
        - exact
        for points in (16, 64, 1024)
    ]
    assert (excess[0] > 0.005).all()
    assert (excess[0] < 0.014).all()
    assert (excess[1] < 0.6 * excess[0]).all()
    assert np.abs(excess[2]) == pytest.approx(0, abs=0.0015)
