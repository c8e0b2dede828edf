"""Outlines with heights in Blender: dropped, imported, with heights of the panel."""

import bpy
import numpy as np
import pytest
from footprint_text import feature, square, write_map
from steps import here, refuse, run, session_here

from citypv.operators.run.solar_city import CityHandler

HOUSES = (
    feature(square(0, 0), "way/1", height=6, eaves=4),
    feature(square(30, 0), "way/2", height=12, eaves=8),
)


def heights():
    """Size of the buildings' meshes along z [m]."""
    points = session_here().city.points
    return float(np.ptp(points[:, 2]))


def test_a_map_is_imported_and_classified(addon, tmp_path):
    path = write_map(tmp_path / "town.geojson", *HOUSES)
    run("import_city", city_path=str(path))
    assert set(session_here().city.building_id) == {"way/1", "way/2"}
    assert heights() == pytest.approx(12)
    assert any("heights from height" in sentence for sentence in here()["citypv_report"])
    run("import_city", height="eaves")
    assert heights() == pytest.approx(8)
    run("classify")


def test_a_map_without_heights_asks_for_one(addon, tmp_path):
    path = write_map(tmp_path / "bare.geojson", feature(square(0, 0), "a"))
    addon.city_path = str(path)
    refuse("import_city", "neither a height nor floors")
    run("import_city", default_height=5.0)
    assert heights() == pytest.approx(5)


def test_maps_may_be_dropped_and_chosen(addon):
    dropped = CityHandler.bl_file_extensions.split(";")
    assert {".geojson", ".gpkg", ".osm"} <= set(dropped)
    for name in ("geojson", "gpkg"):
        shown = bpy.ops.citypv.choose_city.get_rna_type().properties["filter_glob"].default
        assert f"*.{name};" in shown
