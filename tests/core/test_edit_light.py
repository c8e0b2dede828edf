"""Edits of a city: what they trace anew gives the bits of a full run of the edited city."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from cities import box, make_city
from reliefs import hill, tin

from citypv.core.city.city import Tree
from citypv.core.city.edit_city import Change, edit_city
from citypv.core.city.terrain import Layer, Terrain
from citypv.core.light.compare_cities import match_patches
from citypv.core.light.difference import errors_of_difference
from citypv.core.light.edit_light import edit_light, trace_editable
from citypv.core.light.editable_city import prepare_decided
from citypv.core.light.prepare_scene import build_tree
from citypv.core.light.sun_visibility import projection_in_front
from citypv.core.photons.specular_light import specular_of
from citypv.core.rays.hemisphere_rays import hemisphere_rays
from citypv.core.rays.sample_points import HEMISPHERE_REPLICATES, sobol_digits
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request
from citypv.core.study import place_city, read_year, stand_city, trace_base

pytestmark = pytest.mark.once

REQUEST = Request(
    samples=64, shadow_samples=16, suns="days:1", weather=["clear-sky"], latitude=50.0, longitude=8.0, threads=1
)
MATRICES = ("visible_share", "direct_reflected")
NUMBERS = ("diffuse_relative", "diffuse_relative_standard_error", "direct_annual_standard_error", "covered_share")
TRACED = ("far_ground", "covered", "element_far_ground", "open_share", "samples")
SAME = 1e-3  # [m] apart, places are the same


def houses(number=9, seed=3):
    """Boxes of several heights, no two of which touch."""
    generator = np.random.default_rng(seed)
    places = 15.0 * np.stack([np.arange(number) % 3, np.arange(number) // 3], axis=1) + generator.random((number, 2))
    size = generator.choice([8.0, 10.0, 12.0, 13.5], (number, 2))
    return [
        part
        for k, (x, y) in enumerate(places)
        for part in box(f"b{k}", x, y, *size[k], 0.0, generator.choice([6.0, 9.0, 14.0, 25.0]))
    ]


def row_of_houses():
    """Party walls, of the same and of other heights."""
    heights = (9.0, 9.0, 12.0, 6.0, 12.0)
    return [part for k, height in enumerate(heights) for part in box(f"b{k}", 8.0 * k, 0, 8, 10, 0, height)]


def courtyard():
    sides = ((0, 0, 30, 8), (0, 22, 30, 8), (0, 8, 8, 14), (22, 8, 8, 14))
    blocks = [part for k, (x, y, w, d) in enumerate(sides) for part in box(f"b{k}", x, y, w, d, 0, 12)]
    return [*blocks, *box("b4", 13, 13, 4, 4, 0, 5)]


def canopy():
    """A roof on nothing, lit on both sides, between two houses."""
    sheet = [(6, 2, 4), (16, 2, 4), (16, 9, 5), (6, 9, 5)]
    return [*box("b0", -4, 0, 8, 10, 0, 9), ("b1", "RoofSurface", [sheet]), *box("b2", 18, 0, 8, 10, 0, 6)]


def tree(name, x, y, height=9.0, evergreen=False):
    place = np.array([x, y, 0.0])
    return Tree(name, "made.gml", 1, place=place, height=height, crown_diameter=6.0, evergreen=evergreen)


CITIES = {
    "houses": (houses, {}),
    "row": (row_of_houses, {}),
    "courtyard": (courtyard, {}),
    "canopy": (canopy, {}),
    "terrain": (houses, {}),
    "trees": (houses, {}),
    "mirror": (row_of_houses, {"max_bounces": 2}),
    "racks": (houses, {"racks": "spacing=4,depth=2"}),
    "all rays": (houses, {"report": "all", "sky": "isotropic"}),
}


def make(name):
    draw, settings = CITIES[name]
    city, request = make_city(draw()), replace(REQUEST, **settings)
    if name == "trees":
        city.trees = [tree("t0", 12, 12), tree("t1", -6, 20, evergreen=True), tree("t2", 30, 4)]
    if name == "terrain":
        points, triangles = tin((-80.0, -80.0), (120.0, 120.0), 20.0, hill)
        city.points[:, 2] += hill(10.0, 10.0)
        city.terrain = Terrain("a hill", [Layer(points, triangles)])
    return city, request


def make_base(name, folder):
    """A city and its traced base."""
    city, request = make(name)
    if name == "mirror":
        path = folder / "mirror.csv"
        path.write_text("surface,albedo,material\nfacade,0.6,mirror\n")
        request = replace(request, albedo_file=str(path))
    scene = place_city(city, request)
    return city, trace_base(scene, read_year(scene.site, request), request)


def draw_change(city, generator):
    """A random edit: something added, removed, moved, raised, or several of these."""
    names = [*dict.fromkeys(city.building_id)]
    one, other = generator.choice(names, 2, replace=False)
    x, y = generator.uniform(city.points[:, :2].min(axis=0) - 5, city.points[:, :2].max(axis=0) + 5).round(1)
    low = float(city.points[:, 2].min())
    new = make_city(box("new", x, y, *generator.choice([3.0, 8.0, 20.0], 2), low, low + generator.choice([4.0, 9, 40])))
    new.trees = [tree("grown", float(x) - 6, float(y))] if city.trees else []
    removed = [one, city.trees[0].name] if city.trees else [one]
    moved = {other: tuple(generator.uniform(-9, 9, 2).round(2))}
    raised = {other: float(generator.choice([-2.0, 3.0, 11.0]))}
    return [
        Change(added=(new,)),
        Change(removed=removed),
        Change(moved=moved),
        Change(raised=raised),
        Change(removed=[one], raised=raised, added=(new,)),
    ][generator.integers(5)]


def hits_of(state):
    """Keys of each patch's hits in a TracedState: dict."""
    parts = state.traced.form_factors.rows
    return {
        int(patch): rows.key[start:stop]
        for rows in parts
        for patch, start, stop in zip(rows.chosen, rows.start, rows.start[1:], strict=False)
    }


def differ_in_hits(*states):
    """Patches whose rays hit something else in two TracedStates: (p,) bool."""
    one, other = map(hits_of, states)
    count = len(states[0].traced.samples)
    return np.array([not np.array_equal(one.get(patch), other.get(patch)) for patch in range(count)])


def rays_apart(before, edited, full, state):
    """Number of rays of two runs of a city that end at different triangles, each of them in the same place.

    That is on an edge that two triangles share, or where faces of two houses coincide.
    """
    states = edited.states[state], full.states[state]
    one, other = map(hits_of, states)
    apart = 0
    for patch in set(np.flatnonzero(differ_in_hits(*states))) & one.keys() & other.keys():
        left = sum((Counter(one[patch].tolist()) - Counter(other[patch].tolist())).values())
        left = max(left, len(other[patch]) - len(one[patch]) + left)
        sequence = sobol_digits(states[1].traced.samples[patch] // HEMISPHERE_REPLICATES)
        rays = hemisphere_rays(full.context.patches, np.array([patch]), sequence)[:2]
        ends = [end_of_rays(city, *(part[0] for part in rays)) for city in (before, full)]
        differ = (ends[0][0] != ends[1][0]).any(axis=(1, 2))
        assert (differ & (np.abs(ends[0][1] - ends[1][1]).max(axis=1) < SAME)).sum() >= left
        apart += left
    return apart


def end_of_rays(city, origins, directions):
    """Triangles, (r, 3, 3), and places, (r, 3), at which rays end; infinity for none."""
    hits, scene = city.context.ray_scene.trace_places(origins, directions), city.prepared.scene
    corners = scene.vertices[scene.triangles[hits.triangle]]
    places = corners[:, 0] + hits.b1[:, None] * (corners[:, 1] - corners[:, 0])
    places += hits.b2[:, None] * (corners[:, 2] - corners[:, 0])
    return corners, np.where(hits.triangle[:, None] >= 0, places, 1e9)


def check_law(base, edited, full):
    """The same bits in all that rays met, in all light and its errors, but for rays of `rays_apart`: their number."""
    apart = 0
    for state, (one, other) in enumerate(zip(edited.city.states, full.city.states, strict=True)):
        found = rays_apart(base.city, edited.city, full.city, state)
        apart += found
        same = np.ones(len(one.traced.samples), bool) if not found else ~differ_in_hits(one, other)
        for name in TRACED:
            assert np.array_equal(getattr(one.traced, name)[same], getattr(other.traced, name)[same]), name
        for name, light in one.traced.first.items():
            for part in ("light", "element", "deviation"):
                found_there = getattr(light, part)[same], getattr(other.traced.first[name], part)[same]
                assert np.array_equal(*found_there), (name, part)
        bits = [city.task.bits[state][same] for city in (edited.city, full.city)]
        assert np.array_equal(*bits)
        if found:
            assert one.transfer.diffuse_relative == pytest.approx(other.transfer.diffuse_relative, abs=0.01)
            continue
        for name in (*MATRICES, *NUMBERS):
            assert np.array_equal(getattr(one.transfer, name), getattr(other.transfer, name)), name
    return apart


def try_edit(base_of, name, seed):
    """Edit a city and trace it in full: number of rays that end elsewhere."""
    city, base = base_of(name)
    change = draw_change(city, np.random.default_rng([seed, *name.encode()]))
    after = edit_city(city, change, base.transfer.site.convergence)
    edited = edit_light(base, stand_city(after, base.request, like=base.scene))
    alone = replace(base.scene, trail=None, drawn=None)  # of sheets nothing is taken over
    prepared = prepare_decided(base.decisions, stand_city(after, base.request, like=alone), base.request)
    full = trace_editable(prepared, base.suns, base.request, specular=specular_of)
    return check_law(base, edited, full)


@pytest.mark.parametrize("name", CITIES)
def test_an_edit_is_a_full_run_of_the_edited_city(base_of, name):
    assert try_edit(base_of, name, seed=1) <= 1


@pytest.mark.thorough
@pytest.mark.parametrize("name", CITIES)
def test_two_hundred_edits_are_full_runs(base_of, name):
    assert sum(try_edit(base_of, name, seed) for seed in range(10, 33)) <= 25  # of more than 200,000


def test_buildings_are_taken_moved_raised_and_named_apart():
    city = make_city([*box("a", 0, 0, 4, 4, 1, 7), *box("b", 9, 0, 4, 4, 2, 5)])
    new = make_city(box("a", 0, 0, 1, 1, 0, 1))
    change = Change(removed=["b"], moved={"a": (0.0, 10.0)}, raised={"a": 3.0}, added=(new,))
    after = edit_city(city, change, convergence=90.0)  # true north is west of the grid
    house = np.unique(np.concatenate([after.rings(row)[0] for row in range(6)]), axis=0)
    assert house[0] == pytest.approx([-10, 0, 1])
    assert house[-1] == pytest.approx([-6, 4, 10])
    assert sorted(set(house[:, 2])) == [1, 10]
    assert after.building_id == ["a"] * 6 + ["a~2"] * 6
    assert len(set(after.surface_id)) == 12
    for wrong, words in ((Change(removed=["c"]), "no building of the city"), (Change(removed=["a", "b"]), "is left")):
        with pytest.raises(InputError, match=words):
            edit_city(city, wrong)


def test_a_tower_leaves_the_ground_around_as_it_was(base_of):
    """Its height asks for ground that reaches further; the lattice stays that of the base, and so do ray origins."""
    city, base = base_of("houses")
    before = base.city.prepared
    after = edit_city(city, Change(added=(make_city(box("tower", 48, 48, 6, 6, 0, 90)),)))
    kept = []
    for like in (before.scene, replace(before.scene, lattice=None)):
        scene = stand_city(after, base.request, like=like)
        found = match_patches(before, build_tree(prepare_decided(base.decisions, scene, base.request), base.request))
        kept.append((found >= 0).sum() / len(before.patches))
    assert kept[0] > 0.9
    assert kept[1] < 0.5


def test_what_cannot_be_edited_is_refused_with_a_cure(base_of):
    city, base = base_of("row")
    prepared = base.city.prepared
    before = np.ones(len(prepared.patches), np.uint32)
    ahead = replace(prepared, patches=replace(prepared.patches, points_before=before))
    tile = replace(prepared, scene=replace(prepared.scene, halo=np.zeros(len(prepared.scene.triangles), np.int8)))
    for one, request, cure in (
        (prepared, replace(base.request, estimator="forward"), "give gather"),
        (ahead, base.request, "one round"),
        (tile, base.request, "without tiles"),
    ):
        with pytest.raises(InputError, match=cure):
            trace_editable(one, base.suns, request)
    leaf, record = base.city.states[0], replace(base.transfer.record, interrupted={"suns_traced": 1, "of": 2})
    states = [replace(leaf, transfer=replace(leaf.transfer, record=record))]
    stopped = replace(base, city=replace(base.city, states=states))
    with pytest.raises(InputError, match="trace it again"):
        edit_light(stopped, stand_city(city, stopped.request, like=stopped.scene))
    with pytest.raises(InputError, match="the base's site"):
        edit_light(base, place_city(city, replace(base.request, latitude=51.0)))


def annual_light(transfer):
    """Light of surfaces per DHI, and per DNI weighted with the suns: (2, n)."""
    direct = transfer.visible_share * projection_in_front(transfer.surfaces.normal, transfer.suns.direction)
    return np.stack([transfer.diffuse_relative, (direct + transfer.direct_reflected) @ transfer.suns.weight])


def test_what_an_edit_does_not_reach_differs_by_nothing(base_of):
    """Without reflections a house behind the others; with them all of a city that is edited into itself."""
    city, base = base_of("houses")
    same = edit_light(base, stand_city(edit_city(city, Change()), base.request, like=base.scene))
    assert same.transfer.record.hemisphere_rays == same.transfer.record.shadow_rays == 0
    found, rows = errors_of_difference(base, same)
    assert (rows[0] == rows[1]).all()
    assert not (annual_light(same.transfer) - annual_light(base.transfer)).any()
    assert not found.diffuse_relative_standard_error.any()
    assert not found.direct_annual_standard_error.any()


@pytest.mark.parametrize("name", ["row", "trees"])
def test_the_preview_is_the_annual_light(base_of, name):
    city, base = base_of(name)
    previews = []
    scene = stand_city(edit_city(city, Change(raised={"b2": 4.0})), base.request, like=base.scene)
    edited = edit_light(base, scene, preview=lambda *light: previews.append(light))
    for found, state in zip(previews, edited.city.states, strict=True):
        direct = annual_light(state.transfer)[1]
        far = state.transfer.far_ground_view_factor * state.transfer.ground_albedo
        direct += far * (state.transfer.suns.weight @ state.transfer.suns.direction[:, 2])
        assert found[0] == pytest.approx(state.transfer.diffuse_relative, rel=1e-6)
        assert found[1] == pytest.approx(direct, rel=1e-4, abs=1e-5)
