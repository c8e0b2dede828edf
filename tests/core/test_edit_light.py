"""Edits of a city: traced by the change alone they give what the edited scene gives when it is
traced wholly.
"""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from cities import box, make_city
from reliefs import hill, tin
from thorough import mark_cases

from citypv.core.city.city import Tree
from citypv.core.city.edit_city import CityChange, edit_city
from citypv.core.city.terrain import Layer, Terrain
from citypv.core.light.change_light import trace_change
from citypv.core.light.editable_city import prepare_decided, trace_editable
from citypv.core.light.errors_of_change import errors_of_difference
from citypv.core.light.sun_visibility import projection_in_front
from citypv.core.run.study import (
    change_scene,
    compute_energy,
    make_located_scene,
    read_year,
    trace_base,
)
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request

REQUEST = Request(
    samples=64,
    shadow_samples=16,
    suns="days:1",
    weather=["clear-sky"],
    latitude=50.0,
    longitude=8.0,
    threads=1,
)


def houses(number=9, seed=3):
    """Boxes of several heights, no two of which touch."""
    generator = np.random.default_rng(seed)
    places = 15.0 * np.stack(
        [np.arange(number) % 3, np.arange(number) // 3], axis=1
    ) + generator.random((number, 2))
    size = generator.choice([8.0, 10.0, 12.0, 13.5], (number, 2))
    return [
        part
        for k, (x, y) in enumerate(places)
        for part in box(f"b{k}", x, y, *size[k], 0.0, generator.choice([6.0, 9.0, 14.0, 25.0]))
    ]


def row_of_houses():
    """Party walls, of the same and of other heights."""
    heights = (9.0, 9.0, 12.0, 6.0, 12.0)
    return [
        part
        for k, height in enumerate(heights)
        for part in box(f"b{k}", 8.0 * k, 0, 8, 10, 0, height)
    ]


def gaps():
    """Blocks a hand before others, and before less than half of some of their walls."""
    first = box("b0", 0, 0, 20, 8, 0, 12) + box("b1", 12, 8.2, 16, 9, 0, 15)
    return first + box("b2", -8, 8.1, 19, 6, 0, 9) + box("b3", 28.25, 2, 7, 9, 0, 12)


def courtyard():
    sides = ((0, 0, 30, 8), (0, 22, 30, 8), (0, 8, 8, 14), (22, 8, 8, 14))
    blocks = [
        part for k, (x, y, w, d) in enumerate(sides) for part in box(f"b{k}", x, y, w, d, 0, 12)
    ]
    return [*blocks, *box("b4", 13, 13, 4, 4, 0, 5)]


def canopy():
    """A roof on nothing, lit on both sides, between two houses."""
    sheet = [(6, 2, 4), (16, 2, 4), (16, 9, 5), (6, 9, 5)]
    return [
        *box("b0", -4, 0, 8, 10, 0, 9),
        ("b1", "RoofSurface", [sheet]),
        *box("b2", 18, 0, 8, 10, 0, 6),
    ]


def tree(name, x, y, height=9.0, evergreen=False):
    place = np.array([x, y, 0.0])
    return Tree(
        name, "made.gml", 1, place=place, height=height, crown_diameter=6.0, evergreen=evergreen
    )


CITIES = {
    "houses": (houses, {}),
    "row": (row_of_houses, {}),
    "gaps": (gaps, {}),
    "courtyard": (courtyard, {"max_bounces": 4}),
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
    scene = make_located_scene(city, request)
    return city, trace_base(scene, read_year(scene.site, request), request)


def draw_change(city, generator):
    """A random edit: something added, removed, moved, raised, or several of these."""
    names = [*dict.fromkeys(city.building_id)]
    one, other = generator.choice(names, 2, replace=False)
    x, y = generator.uniform(
        city.points[:, :2].min(axis=0) - 5, city.points[:, :2].max(axis=0) + 5
    ).round(1)
    low = float(city.points[:, 2].min())
    new = make_city(
        box(
            "new",
            x,
            y,
            *generator.choice([3.0, 8.0, 20.0], 2),
            low,
            low + generator.choice([4.0, 9, 40]),
        )
    )
    new.trees = [tree("grown", float(x) - 6, float(y))] if city.trees else []
    removed = [one, city.trees[0].name] if city.trees else [one]
    moved = {other: tuple(generator.uniform(-9, 9, 2).round(2))}
    # What is lowered keeps more than half of its height: by more it would turn inside out.
    rows = [row for row, name in enumerate(city.building_id) if name == other]
    height = np.ptp(np.concatenate([city.rings(row)[0][:, 2] for row in rows]))
    raised = {other: float(generator.choice([-min(2.0, 0.4 * height), 3.0, 11.0]))}
    return [
        CityChange(added=(new,)),
        CityChange(removed=removed),
        CityChange(moved=moved),
        CityChange(raised=raised),
        CityChange(removed=[one], raised=raised, added=(new,)),
    ][generator.integers(5)]


def trace_wholly(base, change, request=None):
    """The edited scene, its ground as the edit left it, traced like any city, with the same keys:
    EditableCity.
    """
    request = request or base.request
    prepared = prepare_decided(base.decisions, change.scene, request)
    prepared = replace(prepared, rules=base.city.prepared.rules)
    full = trace_editable(prepared, base.suns, request)
    return replace(full, rows=change.rows)


def check_law(edited, full):
    """Hours within a quarter of their stated error on 99 % of the area, the rest within one, the
    total to 1e-5.
    """
    one, other = edited.transfer, full.transfer
    assert one.surfaces.surface_id == other.surfaces.surface_id
    assert np.array_equal(one.surfaces.eligible, other.surfaces.eligible)
    assert one.covered_share == pytest.approx(other.covered_share, abs=1e-6)
    weather = read_year(edited.scene.site, edited.request)
    energy = [compute_energy(transfer, weather, edited.request) for transfer in (one, other)]
    hours, stated = (
        [np.asarray(found.full_load_hours) for found in energy],
        energy[1].full_load_hours_standard_error,
    )
    assert np.array_equal(*map(np.isnan, hours))
    known = np.isfinite(hours[1]) & (one.surfaces.area > 0)
    area, apart = one.surfaces.area[known], np.abs(hours[0] - hours[1])[known]
    stated = np.asarray(stated)[known] + 1e-4  # [h]
    assert (area @ (apart > stated / 4)) <= 0.01 * area.sum()
    assert (apart <= stated).all()
    totals = [area @ found[known] for found in hours]
    assert totals[0] == pytest.approx(totals[1], rel=1e-5)
    check_modules(edited, full)
    lost = [area @ found.string_loss[known] for found in energy]
    assert lost[0] == pytest.approx(lost[1], rel=1e-3, abs=1e-6 * totals[1])


def check_modules(edited, full):
    """Modules lie, and parts of surfaces are taken, as where all surfaces are laid anew."""
    laid = []
    for one in (edited, full):
        layout, number = one.city.context.layout, np.full(len(one.city.context.surfaces), -1)
        number[one.rows] = np.arange(len(one.rows))
        laid.append(None if layout is None else vars(layout.renumber(number)))
    assert (laid[0] is None) == (laid[1] is None)
    for name in laid[0] or ():
        np.testing.assert_allclose(laid[0][name], laid[1][name], atol=1e-6)
    parts = [shapely.area(one.transfer.taken_parts) for one in (edited, full)]
    np.testing.assert_allclose(*map(np.nan_to_num, parts), atol=1e-6)


def try_edit(base_of, name, seed):
    """Edit a city, and hold what the change alone gives against the edited scene traced wholly."""
    city, base = base_of(name)
    change = draw_change(city, np.random.default_rng([seed, *name.encode()]))
    after = edit_city(city, change, base.transfer.site.convergence)
    found = change_scene(base, city, after, base.request)
    check_law(trace_change(base, found), trace_wholly(base, found))


@pytest.mark.slow
@pytest.mark.parametrize("name", mark_cases(CITIES, kept=4))
def test_the_change_alone_is_the_edited_scene_traced_wholly(base_of, name):
    try_edit(base_of, name, seed=1)


@pytest.mark.thorough
@pytest.mark.parametrize("name", CITIES)
def test_two_hundred_edits_are_the_edited_scenes_traced_wholly(base_of, name):
    for seed in range(10, 33):
        try_edit(base_of, name, seed)


@pytest.mark.slow
@pytest.mark.parametrize("name", mark_cases(["houses", "all rays"], kept=1))
def test_ten_edits_in_a_row_keep_the_law(base_of, name):
    """Patches and surfaces that are gone give their numbers away when they are many."""
    city, base = base_of(name)
    generator, sizes = np.random.default_rng(7), []
    for _ in range(10):
        after = edit_city(city, draw_change(city, generator), base.transfer.site.convergence)
        change = change_scene(base, city, after, base.request)
        city, base = after, trace_change(base, change)
        sizes.append(len(base.city.prepared.patches))
    check_law(base, trace_wholly(base, change_scene(base, city, city, base.request)))
    assert max(sizes) < 2 * min(sizes)


@pytest.mark.slow
@pytest.mark.parametrize("name", mark_cases(["houses", "courtyard", "trees", "all rays"], kept=2))
def test_single_suns_of_a_large_city_follow_the_change(base_of, name, monkeypatch):
    """Visible shares are exact, so is the sum over the suns; what is guessed moves light from sun
    to sun by little.
    """
    monkeypatch.setattr("citypv.core.light.change_suns.SMALL", 0)
    monkeypatch.setattr("citypv.core.light.change_suns.GUESSED", np.inf)
    city, base = base_of(name)
    change = change_scene(
        base, city, edit_city(city, CityChange(raised={"b2": 4.0}, removed=["b0"])), base.request
    )
    edited, full = trace_change(base, change), trace_wholly(base, change)
    assert 0 < edited.drift < 0.05
    seasons = [[one.transfer, one.transfer.bare][: len(one.city.states)] for one in (edited, full)]
    for found, expected in zip(*seasons, strict=True):
        assert np.abs(found.visible_share - expected.visible_share).max() < 1e-6
        sums = [one.direct_reflected @ one.suns.weight for one in (found, expected)]
        assert sums[0] == pytest.approx(sums[1], rel=1e-4, abs=1e-5)
        apart = np.abs(found.direct_reflected - expected.direct_reflected) @ found.suns.weight
        area = found.surfaces.area
        assert area @ apart < 0.05 * (area @ sums[1])


@pytest.mark.slow
def test_a_guess_goes_when_every_sun_is_solved(base_of, monkeypatch):
    """Also from surfaces that the edit does not reach: the second one changes nothing."""
    monkeypatch.setattr("citypv.core.light.change_suns.SMALL", 0)
    monkeypatch.setattr("citypv.core.light.change_suns.GUESSED", np.inf)
    city, base = base_of("houses")
    after = edit_city(city, CityChange(raised={"b2": 4.0}, removed=["b0"]))
    change = change_scene(base, city, after, base.request)
    guessed, full = trace_change(base, change), trace_wholly(base, change)
    monkeypatch.setattr("citypv.core.light.change_suns.GUESSED", -1.0)
    solved = trace_change(guessed, change_scene(guessed, after, after, base.request))
    expected = full.transfer.direct_reflected
    apart = [np.abs(one.transfer.direct_reflected - expected).max() for one in (guessed, solved)]
    assert apart[0] > 10 * apart[1]
    assert apart[1] < 1e-4 * expected.max()


def test_buildings_are_taken_moved_raised_and_named_apart():
    city = make_city([*box("a", 0, 0, 4, 4, 1, 7), *box("b", 9, 0, 4, 4, 2, 5)])
    new = make_city(box("a", 0, 0, 1, 1, 0, 1))
    change = CityChange(removed=["b"], moved={"a": (0.0, 10.0)}, raised={"a": 3.0}, added=(new,))
    after = edit_city(city, change, convergence=90.0)  # true north is west of the grid
    house = np.unique(np.concatenate([after.rings(row)[0] for row in range(6)]), axis=0)
    assert house[0] == pytest.approx([-10, 0, 1])
    assert house[-1] == pytest.approx([-6, 4, 10])
    assert sorted(set(house[:, 2])) == [1, 10]
    assert after.building_id == ["a"] * 6 + ["a~2"] * 6
    assert len(set(after.surface_id)) == 12
    for wrong, words in (
        (CityChange(removed=["c"]), "no building of the city"),
        (CityChange(removed=["a", "b"]), "is left"),
    ):
        with pytest.raises(InputError, match=words):
            edit_city(city, wrong)


def test_only_the_ground_under_what_comes_and_goes_changes(base_of):
    """A tower in an open place punches a hole of its own size; where a house goes ground closes its
    footprint.
    """
    city, base = base_of("houses")
    plan = {}
    tower = CityChange(added=(make_city(box("tower", 48, 48, 6, 6, 0, 90)),))
    for name, edit in {
        "before": CityChange(),
        "tower": tower,
        "gone": CityChange(removed=["b4"]),
    }.items():
        scene = change_scene(base, city, edit_city(city, edit), base.request).scene
        corners = scene.vertices[scene.triangles[scene.triangle_surface < 0]]
        sides = corners[:, 1:, :2] - corners[:, :1, :2]
        plan[name] = (sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]).sum() / 2
    floor = next(
        row
        for row in range(len(city))
        if city.building_id[row] == "b4" and city.thematic[row] == "GroundSurface"
    )
    size = np.ptp(city.rings(floor)[0][:, :2], axis=0).prod()
    assert plan["before"] - plan["tower"] == pytest.approx(36.0, abs=1e-3)
    assert plan["gone"] - plan["before"] == pytest.approx(size, abs=1e-3)


def test_what_cannot_be_edited_is_refused_with_a_cure(base_of):
    city, base = base_of("row")
    prepared = base.city.prepared
    before = np.ones(len(prepared.patches), np.uint32)
    ahead = replace(prepared, patches=replace(prepared.patches, points_before=before))
    tile = replace(
        prepared,
        scene=replace(prepared.scene, halo=np.zeros(len(prepared.scene.triangles), np.int8)),
    )
    for one, request, cure in (
        (prepared, replace(base.request, estimator="forward"), "give gather"),
        (ahead, base.request, "one round"),
        (tile, base.request, "without tiles"),
    ):
        with pytest.raises(InputError, match=cure):
            trace_editable(one, base.suns, request)
    leaf, record = (
        base.city.states[0],
        replace(base.transfer.record, interrupted={"suns_traced": 1, "of": 2}),
    )
    states = [replace(leaf, transfer=replace(leaf.transfer, record=record))]
    stopped = replace(base, city=replace(base.city, states=states))
    with pytest.raises(InputError, match="trace it again"):
        trace_change(stopped, change_scene(base, city, city, base.request))
    points, triangles = tin((-80.0, -80.0), (120.0, 120.0), 20.0, hill)
    hilly = replace(city, terrain=Terrain("a hill", [Layer(points, triangles)]))
    with pytest.raises(InputError, match="terrain"):
        change_scene(base, city, hilly, base.request)


def annual_light(transfer):
    """Light of surfaces per DHI, and per DNI weighted with the suns: (2, n)."""
    direct = transfer.visible_share * projection_in_front(
        transfer.surfaces.normal, transfer.suns.direction
    )
    return np.stack(
        [transfer.diffuse_relative, (direct + transfer.direct_reflected) @ transfer.suns.weight]
    )


@pytest.mark.slow
def test_what_an_edit_does_not_reach_differs_by_nothing(base_of):
    """Without reflections a house behind the others; with them all of a city that is edited into
    itself.
    """
    city, base = base_of("houses")
    same = trace_change(base, change_scene(base, city, edit_city(city, CityChange()), base.request))
    assert same.transfer.record.hemisphere_rays == same.transfer.record.shadow_rays == 0
    found, rows = errors_of_difference(base, same)
    assert (rows[0] == rows[1]).all()
    assert not (annual_light(same.transfer) - annual_light(base.transfer)).any()
    assert not found.diffuse_relative_standard_error.any()
    assert not found.direct_annual_standard_error.any()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["row", "trees"])
def test_the_preview_is_the_annual_light(base_of, name):
    city, base = base_of(name)
    previews = []
    change = change_scene(base, city, edit_city(city, CityChange(raised={"b2": 4.0})), base.request)
    edited = trace_change(base, change, preview=lambda *light: previews.append(light))
    seasons = [edited.transfer, edited.transfer.bare][: len(edited.city.states)]
    for found, transfer in zip(previews, seasons, strict=True):
        direct = annual_light(transfer)[1]
        far = transfer.far_ground_view_factor * transfer.ground_albedo
        direct += far * (transfer.suns.weight @ transfer.suns.direction[:, 2])
        assert found[0] == pytest.approx(transfer.diffuse_relative, rel=1e-6)
        assert found[1] == pytest.approx(direct, rel=1e-4, abs=1e-5)
