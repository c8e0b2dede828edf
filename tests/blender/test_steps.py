"""The steps as a user takes them, from a file to coloured full load hours, in a script without a
window.
"""

import bpy
import pytest
from reliefs import relief
from small_city import write_gml
from steps import refuse, run
from street import STREET

from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request
from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.build_meshes import read_vertices
from citypv.operators.city.read_settings import read_settings
from citypv.operators.city.session import Session, find_city
from citypv.operators.show.keep_report import read_rows


def run_steps(path, *steps):
    run(*steps, city_path=str(path), suns="typical-days", typical_days=2, samples=64)
    return find_city(bpy.context.scene)


def test_importing_again_takes_the_place_of_the_first(addon, city_file):
    run_steps(city_file, "import_city", "classify", "import_city")
    assert [item.name for item in bpy.context.scene.objects] == ["City"]
    assert [mesh.name for mesh in bpy.data.meshes] == ["City"]
    assert not bpy.ops.citypv.trace.poll()


@pytest.mark.slow
def test_tracing_anew_takes_back_the_energy(addon, city_file):
    run_steps(city_file, "import_city", "classify", "trace", "energy")
    city, _ = run_steps(city_file, "trace")
    assert "citypv_full_load_hours" not in city.data.attributes
    assert "citypv_groups" not in city
    addon.attribute = "full_load_hours"
    refuse("colour", "City: its faces have no full load hours yet")


TERRAIN = (
    "ncols 3\nnrows 3\nxllcorner 389940\nyllcorner 5817940\ncellsize 60\nnodata_value -9999\n"
    + 3 * "32 32 32\n"
)


@pytest.mark.slow
def test_the_city_stands_on_the_terrain_of_a_file(addon, city_file, tmp_path):
    path = tmp_path / "terrain.asc"
    path.write_text(TERRAIN)
    addon.ground, addon.terrain = "terrain", str(path)
    city, ground = run_steps(city_file, "import_city", "classify")
    heights = read_vertices(ground)[:, 2]
    # The walls begin at 30 m; the terrain, at 32 m, cuts them.
    assert heights.max() == pytest.approx(2.0, abs=1e-4)
    session = Session.of(city)
    assert len(session.scene.report.repaired["continues below the terrain, cut off at it"]) >= 3
    rows = [row["name"] for row in read_rows(city, "repaired")]
    assert "continues below the terrain, cut off at it" in rows


@pytest.mark.slow
def test_terrain_of_the_file_is_shown_and_stood_on(addon, city_file, tmp_path):
    """Two triangles, 2 m above the level on which the street begins."""
    corners = [(-200, -200, 2), (200, -200, 2), (200, 200, 2), (-200, 200, 2)]
    path = write_gml(tmp_path / "street.gml", *STREET, relief(corners, [(0, 1, 2), (0, 2, 3)]))
    city, ground = run_steps(path, "import_city")
    assert len(ground.data.polygons) == 2
    assert read_vertices(ground)[:, 2] == pytest.approx(2.0, abs=1e-4)
    assert len(read_face_attribute(city.data, "surface")) == len(city.data.polygons)
    city, ground = run_steps(path, "classify")
    assert read_vertices(ground)[:, 2].max() == pytest.approx(2.0, abs=1e-4)
    assert "Ground: terrain of the file: 2 triangles." in Session.of(city).scene.report.notes


def test_terrain_that_cannot_be_used_is_an_error_in_one_line(addon, city_file, tmp_path):
    run_steps(city_file, "import_city")
    addon.ground = "terrain"
    refuse("classify", "Terrain: no file is chosen; choose a terrain file")
    path = tmp_path / "far.asc"
    path.write_text(TERRAIN.replace("389940", "489940"))
    addon.terrain = str(path)
    refuse("classify", r"far\.asc: ")


@pytest.mark.parametrize("content", ["", "<CityModel", "no XML at all"])
def test_a_file_that_cannot_be_used_is_an_error_in_one_line(addon, tmp_path, content):
    path = tmp_path / "broken.gml"
    path.write_text(content)
    refuse("import_city", f"^Error: {path}: ", filepath=str(path))
    assert not bpy.data.objects


@pytest.mark.parametrize(
    ("weather", "years", "asked"),
    [
        ("pvgis", "", "pvgis"),
        ("pvgis", "2005-2023", "pvgis:2005-2023"),
        ("nasa-power", " 2019 ", "nasa-power:2019"),
    ],
)
def test_no_download_without_online_access(addon, city_file, weather, years, asked):
    addon.weather, addon.weather_years = weather, years
    if bpy.app.online_access:
        assert read_settings(addon).weather == asked
    else:
        with pytest.raises(InputError, match=r"Weather: .*online access"):
            read_settings(addon)
    addon.weather, addon.horizon = "climate", "pvgis"
    if not bpy.app.online_access:
        with pytest.raises(InputError, match=r"Horizon: .*online access"):
            read_settings(addon)


def test_an_own_location_that_was_not_filled_in_is_refused(addon, city_file):
    addon.city_path, addon.own_place = str(city_file), True
    refuse("solar_city", r"Own location: 0° N, 0° E lies in the sea; give latitude and longitude")
    addon.longitude = 9.4  # on the equator, in Gabon
    assert read_settings(addon).latitude == 0


def test_settings_become_a_request(addon, tmp_path):
    assert read_settings(addon) == Request()
    addon.suns, addon.sky_grid = "sky-grid", 1000
    addon.own_place, addon.latitude, addon.longitude = True, -33.5, 151.25
    addon.weather, addon.weather_file = "file", str(tmp_path / "year.epw")
    addon.split, addon.grid_size, addon.threads, addon.lod = True, 2.5, 3, "1"
    addon.horizon = str(tmp_path / "horizon.csv")
    request = read_settings(addon)
    assert request.suns == "sky-grid:1000"
    assert (request.latitude, request.longitude) == (-33.5, 151.25)
    assert (request.weather, request.horizon) == (
        str(tmp_path / "year.epw"),
        str(tmp_path / "horizon.csv"),
    )
    assert (request.grid_size, request.threads, request.lod) == (2.5, 3, "1")
    addon.suns = "hourly"
    assert read_settings(addon).suns == "hourly"
    addon.ground, addon.terrain = "none", str(tmp_path / "terrain.tif")
    assert (read_settings(addon).ground, read_settings(addon).terrain) == ("none", None)
    addon.ground = "terrain"
    assert (read_settings(addon).ground, read_settings(addon).terrain) == (
        "auto",
        str(tmp_path / "terrain.tif"),
    )


@pytest.mark.slow
def test_a_city_that_is_gone_when_a_step_ends_is_an_error(addon, city_file):
    city, _ = run_steps(city_file, "import_city", "classify")
    session = Session.of(city)
    assert session.find_city(bpy.context.scene)[0] == city
    run_steps(city_file, "import_city")
    with pytest.raises(InputError, match="deleted or replaced while the step ran"):
        session.find_city(bpy.context.scene)
