"""What a run writes stands in the system of its files, and is read again with the same hours."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj
import pytest
from citygml_text import HEAD, building, members, polygon, surface, wrap
from sheds import CLOSED, write_shed
from thorough import mark_cases

import citypv
from citypv.core.city.terrain import Layer, Terrain
from citypv.core.commands.command_line import main
from citypv.core.results.cityjson_surroundings import list_objects, list_points
from citypv.core.run.study import read_buildings
from citypv.core.settings.request import Request

FEW = {"preset": "draft", "suns": "days:2", "samples": 16, "shadow_samples": 1}


def add_tree(path, crs, latitude, longitude):
    """Add a tree south of the shed, as a point with numbers, in the order of the registry."""
    plane = pyproj.CRS(crs)
    degrees = plane.is_geographic
    unit = 1.0 if degrees else plane.axis_info[0].unit_conversion_factor
    turn = pyproj.Transformer.from_crs(plane.geodetic_crs, plane)
    x, y = turn.transform(
        latitude - 6 / 111_250, longitude + 5 / (111_320 * np.cos(np.radians(latitude)))
    )
    place = f"<gml:Point><gml:pos>{x:.10f} {y:.10f} 0</gml:pos></gml:Point>"
    tree = f"""<cityObjectMember><veg:SolitaryVegetationObject xmlns:veg="http://www.opengis.net/citygml/vegetation/2.0"
 gml:id="oak"><veg:height uom="m">9</veg:height><veg:crownDiameter uom="m">5</veg:crownDiameter>
<veg:lod2ImplicitRepresentation><ImplicitGeometry><referencePoint>{place}</referencePoint></ImplicitGeometry>
</veg:lod2ImplicitRepresentation></veg:SolitaryVegetationObject></cityObjectMember>"""
    path.write_text(path.read_text().replace("</CityModel>", tree + "</CityModel>"))
    return unit


@pytest.mark.slow
@pytest.mark.parametrize(
    ("crs", "latitude", "longitude"),
    mark_cases(
        [
            ("EPSG:4326", 52.08, 4.3),
            ("EPSG:2263", 40.75, -73.99),
            ("EPSG:3857", 52.5, 13.4),
            ("EPSG:5513", 50.08, 14.42),
        ],
        kept=2,
    ),
)
def test_what_was_written_is_read_again_with_the_same_hours(tmp_path, crs, latitude, longitude):
    """city.city.json has the coordinates of the source, its system and its trees."""
    path = write_shed(tmp_path / "shed.gml", crs, latitude, longitude, envelope=CLOSED)
    add_tree(path, crs, latitude, longitude)
    first = citypv.simulate(path, exports=["cityjson", "geopackage"], **FEW)
    written = Path(first.folder) / "city.city.json"
    again = citypv.simulate(written, **FEW)
    assert [city.summary["input"]["site"]["crs"] for city in (first, again)] == [crs, crs]
    hours = [one.faces.set_index("surface_id")["full_load_hours"] for one in (first, again)]
    assert hours[1][hours[0].index].to_numpy() == pytest.approx(
        hours[0].to_numpy(), rel=1e-3, nan_ok=True
    )
    # The source's own numbers, in its order.
    document = json.loads(written.read_text(encoding="utf-8"))
    vertices = (
        np.array(document["vertices"]) * document["transform"]["scale"]
        + document["transform"]["translate"]
    )
    source = np.array(path.read_text().split("<gml:posList>")[1].split()[:3], float)
    assert np.abs(vertices - source).max(axis=1).min() < (1e-8 if crs == "EPSG:4326" else 1e-3)
    oak = document["CityObjects"]["oak"]
    assert (oak["type"], oak["attributes"]["crownDiameter"]) == ("SolitaryVegetationObject", 5.0)
    # The building's middle, on Earth and in the system of the files.
    row = pd.read_csv(Path(first.folder) / "buildings.csv").iloc[0]
    assert (row["latitude"], row["longitude"]) == pytest.approx((latitude, longitude), abs=1e-4)
    x, y = (vertices[:, :2].min(axis=0) + vertices[:, :2].max(axis=0)) / 2
    own = (y, x) if crs in ("EPSG:4326", "EPSG:5513") else (x, y)
    assert (row["easting"], row["northing"]) == pytest.approx(
        own, abs=1e-3 if crs == "EPSG:4326" else 20
    )


def test_parts_and_terrain_are_written(tmp_path):
    """Objects of CityJSON for parts and for the terrain of the files, which are read again."""
    part = surface(
        members(polygon("p", [(20, 0, 4), (30, 0, 4), (30, 8, 10), (20, 8, 10)])), "RoofSurface"
    )
    part = wrap(part, "bldg:consistsOfBuildingPart", "bldg:BuildingPart")
    own = surface(
        members(polygon("q", [(0, 0, 4), (10, 0, 4), (10, 8, 10), (0, 8, 10)])), "RoofSurface"
    )
    (tmp_path / "a.gml").write_text(HEAD + building(own, part) + "</CityModel>")
    city = read_buildings([tmp_path / "a.gml"], Request())
    assert city.part == ["", "1"]
    triangle = np.array([[0.0, 0, 0], [50, 0, 1], [0, 50, 2]])
    city.terrain = Terrain("own", [Layer(triangle, np.array([[0, 1, 2]]))])
    objects = list_objects(city, [0, 1, 2], ["house"])
    geometry = [{"type": "CompositeSurface", "lod": "1", "boundaries": [[[0, 1, 2]]]}]
    assert objects == {"terrain": {"type": "TINRelief", "geometry": geometry}}
    assert list_points(city) == pytest.approx(triangle)


@pytest.mark.slow
def test_what_is_added_later_stands_in_the_system_of_the_base(tmp_path):
    """To a base in degrees a file with the other order of axes, and an OBJ that names no system,
    are added.
    """
    base = write_shed(tmp_path / "base.gml", "EPSG:4326", 52.08, 4.3, envelope=CLOSED)
    more = write_shed(
        tmp_path / "more.gml", "EPSG:4326", 52.0803, 4.3, order="other", envelope=CLOSED
    )
    more.write_text(more.read_text().replace('gml:id="house"', 'gml:id="more"'))
    corners = [(52.0797, 4.3, 0), (52.0797, 4.3001, 0), (52.07977, 4.3001, 5), (52.07977, 4.3, 5)]
    lines = ["o roof", *(f"v {x:.10f} {y:.10f} {z}" for x, y, z in corners), "f 1 2 3 4"]
    (tmp_path / "roof.obj").write_text("\n".join(lines) + "\n")
    citypv.simulate(base, exports=["editable"], max_bounces=3, **FEW).save(tmp_path / "first")
    added = ["--add", str(more), "--add", str(tmp_path / "roof.obj")]
    assert (
        main(
            [
                "variant",
                str(tmp_path / "first"),
                *added,
                "--out",
                str(tmp_path / "second"),
                "--quiet",
            ]
        )
        == 0
    )
    table = pd.read_csv(tmp_path / "second" / "buildings.csv").set_index("building_id")
    half = 4 / 111_250  # [°] half of the shed's 8 m northwards
    middles = {"house": 52.08 + half, "more": 52.0803 + half, "roof": 52.079735}
    for name, latitude in middles.items():
        assert table.loc[name, "latitude"] == pytest.approx(latitude, abs=1e-6)
        assert table.loc[name, "northing"] == pytest.approx(latitude, abs=1e-6)
    assert table.loc["roof", "easting"] == pytest.approx(4.30005, abs=1e-8)
