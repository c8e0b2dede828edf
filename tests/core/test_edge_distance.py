"""Distance of facades to the edge of the city, by hand, and what a run says of it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from cities import box, make_city
from transfers import unshaded_transfer

from citypv.core.city.build_scene import build_scene
from citypv.core.city.edge_distance import measure_edge_distance
from citypv.core.city.edit_city import CityChange, edit_city
from citypv.core.results.describe_run import describe_edge
from citypv.core.results.transfer_file import read_transfer, write_transfer
from citypv.core.results.write_summary import measure_edge
from citypv.core.run import variant
from citypv.core.run.study import make_located_scene, read_year, trace_base
from citypv.core.settings.request import Request
from citypv.core.sun.sky_grid import sky_grid_suns


def rows_of_houses(columns, rows, turn=0.0, gap=0):
    """Scene of houses of 10 × 8 m, 30 m apart each way, without `gap` × `gap` of them in the
    middle; turned [°].
    """
    places = [(x, y) for x in range(columns) for y in range(rows)]
    left_out = range((columns - gap) // 2, (columns - gap) // 2 + gap)
    places = [place for place in places if not (place[0] in left_out and place[1] in left_out)]
    city = make_city(
        [face for x, y in places for face in box(f"{x}-{y}", 30 * x, 30 * y, 10, 8, 0, 6 + x)]
    )
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    city.points[:, :2] = city.points[:, :2] @ np.array([[c, s], [-s, c]])
    return build_scene(city, latitude=50, longitude=10)


@pytest.mark.slow
def test_an_edit_at_the_rim_renews_it_and_its_estimate_does_not_wait(monkeypatch):
    """As in a scene made of the edited city."""
    request = Request(
        samples=16, shadow_samples=1, suns="days:1", weather=["clear-sky"], latitude=50, longitude=8
    )
    houses = [box(f"{x}-{y}", 30 * x, 30 * y, 10, 8, 0, 6) for x in range(9) for y in range(7)]
    city = make_city([face for house in houses for face in house])
    scene, calls = make_located_scene(city, request), []
    base = trace_base(scene, read_year(scene.site, request), request)
    new = make_city(box("new", 270, 90, 10, 8, 0, 9))
    edited = edit_city(city, CityChange(removed=["0-3"], added=(new,)), 0.0)

    def measure(scene):
        calls.append("edge")
        return measure_edge_distance(scene)

    monkeypatch.setattr(variant, "measure_edge_distance", measure)
    _, traced = variant.trace_edit(base, city, edited, preview=lambda *_: calls.append("estimate"))
    assert calls == ["estimate", "edge"]
    found = dict(
        zip(traced.transfer.surfaces.surface_id, traced.transfer.edge_distance, strict=True)
    )
    expected = make_located_scene(edited, request).surfaces
    for name, distance in zip(expected.surface_id, expected.edge_distance, strict=True):
        assert found[name] == pytest.approx(distance, abs=0.05, nan_ok=True), name
    before = dict(zip(scene.surfaces.surface_id, scene.surfaces.edge_distance, strict=True))
    both = found.keys() & before.keys()
    assert sum(np.nan_to_num(found[name] - before[name]) != 0 for name in both) >= 3


def sides_of(scene, turn):
    """Column and row of the house of each facade, and the side that it looks to before the city was
    turned.
    """
    surfaces, found = scene.surfaces, {}
    distance = measure_edge_distance(scene)
    for row in np.flatnonzero(np.asarray(surfaces.kind) == "facade"):
        side = "NESW"[
            round((surfaces.surface_azimuth[row] + turn - scene.site.convergence) / 90) % 4
        ]
        found[*map(int, surfaces.building_id[row].split("-")), side] = distance[row]
    assert np.isnan(distance[np.asarray(surfaces.kind) != "facade"]).all()
    return found


@pytest.mark.parametrize("turn", [0, 28])
def test_it_is_the_way_to_the_outline(turn):
    """Of nine columns and seven rows: the outline is a rectangle of 250 × 188 m."""
    found = sides_of(rows_of_houses(9, 7, turn), turn)
    for (x, y, side), distance in found.items():
        ways = {"N": 188 - 8 - 30 * y, "E": 250 - 10 - 30 * x, "S": 30 * y, "W": 30 * x}
        expected = ways[side] if ways[side] <= 100 else np.nan
        assert distance == pytest.approx(expected, abs=0.02, nan_ok=True), (x, y, side)
    assert len(found) == 4 * 63


def test_a_square_within_is_no_edge_and_neither_is_a_hamlet():
    """Six by six houses are missing in the middle: 172 m across, wider than twice 50 m."""
    whole, square = (sides_of(rows_of_houses(12, 12, gap=gap), 0) for gap in (0, 6))
    for place, distance in square.items():
        assert distance == pytest.approx(whole[place], abs=0.02, nan_ok=True)
    assert np.isfinite(list(sides_of(rows_of_houses(10, 5), 0).values())).any()
    assert np.isnan(list(sides_of(rows_of_houses(7, 7), 0).values())).all()


def test_a_run_says_what_it_meant(tmp_path):
    """Four walls of 100 m² each way: at the edge 900 h, at 60 m 720 h, further in 600 h."""
    transfer = unshaded_transfer(sky_grid_suns(16), [90] * 8, [180] * 4 + [0] * 4)
    distance = np.array([0, 60, np.nan, np.nan] * 2, float)
    surfaces = replace(transfer.surfaces, area=np.full(8, 100.0), edge_distance=distance)
    hours = np.tile([900.0, 720.0, 600.0, 600.0], 2)
    energy = SimpleNamespace(
        eligible=np.ones(8, bool), counted_area=np.full(8, 100.0), full_load_hours=hours
    )
    transfer = replace(transfer, surfaces=surfaces)
    edge = measure_edge(transfer, energy)
    assert (edge["share_within_25"], edge["share_within_100"]) == (25, 50)
    assert edge["more_hours_within_25"] == pytest.approx(50)
    assert edge["more_hours_within_100"] == pytest.approx(100 * (810 / 600 - 1))
    said = describe_edge({"edge": edge})
    assert "25 % within 25 m and 50 % within 100 m" in said and "+50.0 % and +35.0 %" in said
    for unknown in (None, np.full(8, np.nan)):
        nowhere = replace(transfer, surfaces=replace(surfaces, edge_distance=unknown))
        assert measure_edge(nowhere, energy) == {} and describe_edge({}) == ""
    # Kept for other weather.
    write_transfer(tmp_path / "transfer.nc", transfer)
    np.testing.assert_array_equal(
        read_transfer(tmp_path / "transfer.nc").surfaces.edge_distance, distance
    )


def test_a_surface_without_triangles_has_no_distance():
    """Slivers are not triangulated; they were a line without place for shapely."""
    scene = rows_of_houses(9, 7)
    wall = np.flatnonzero(np.asarray(scene.surfaces.kind) == "facade")[0]
    whole = measure_edge_distance(scene)
    kept = scene.triangle_surface != wall
    bare = replace(
        scene,
        triangles=scene.triangles[kept],
        triangle_surface=scene.triangle_surface[kept],
    )
    expected = whole.copy()
    expected[wall] = np.nan
    np.testing.assert_allclose(measure_edge_distance(bare), expected)
