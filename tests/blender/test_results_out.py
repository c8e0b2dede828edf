"""Exports, best buildings and charts of the probe: the same numbers as in the tables of the command
line.
"""

import json
import sqlite3
import sys
from contextlib import closing

import bpy
import numpy as np
import pandas as pd
import pytest
from steps import forget_module, refuse, run

from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.build_meshes import suggest_buildings
from citypv.operators.city.session import Session
from citypv.operators.run.export_results import FILES, FORMATS
from citypv.operators.show.probe_faces import read_charts
from citypv.operators.show.select_faces import read_selection
from citypv.operators.show.show_building import read_best


@pytest.mark.slow
def test_exports_best_buildings_and_charts_agree(city, tmp_path, monkeypatch):
    run("keep_before")  # what the city is compared with
    for name, _, _ in FORMATS:
        path = tmp_path / FILES[name][0]
        assert bpy.ops.citypv.export(format=name, filepath=str(path)) == {"FINISHED"}
        assert path.stat().st_size > 200, name
    faces, buildings = pd.read_csv(tmp_path / "faces.csv"), pd.read_csv(tmp_path / "buildings.csv")
    assert len(json.loads((tmp_path / "city.city.json").read_text("utf-8"))["CityObjects"]) == 3
    assert (tmp_path / "city.glb").read_bytes()[:4] == b"glTF"
    with closing(sqlite3.connect(tmp_path / "city.gpkg")) as file:
        assert file.execute("SELECT count(*) FROM surfaces").fetchone()[0] == len(faces) == 21
    assert "data:image" in (tmp_path / "report.html").read_text("utf-8")
    monkeypatch.setitem(sys.modules, "matplotlib", None)  # as in Blender's own Python
    drawing = ("citypv.core.results.draw_", "citypv.core.results.picture")
    for name in [name for name in sys.modules if name.startswith(drawing)]:
        forget_module(monkeypatch, name)
    assert bpy.ops.citypv.export(format="report", filepath=str(tmp_path / "plain.html")) == {
        "FINISHED"
    }
    plain = (tmp_path / "plain.html").read_text("utf-8")
    assert 'id="city-data"' in plain  # the city in 3D
    assert (
        "no plans of the city" in plain
        and "data:image" not in plain
        and "Full load hours by kind" in plain
    )

    # The best buildings are those of buildings.csv, in its order of energy.
    best, ranked = read_best(city), buildings.sort_values("mwh_per_year", ascending=False)
    assert [name for name, _, _ in best] == list(ranked["building_id"])
    assert [float(mwh) for _, _, mwh in best] == pytest.approx(
        list(ranked["mwh_per_year"]), abs=0.06
    )
    run("show_building")
    shown = read_face_attribute(city.data, "building")[read_selection(city.data)]
    assert set(shown) == {list(city["citypv_buildings"]).index(best[0][0])}
    refuse("show_building", "no building 'Castle'", building="Castle")
    # A building is found by its address, its name or its id, whatever accents and case.
    (told,) = buildings.loc[buildings["address"].notna(), "building_id"]
    where = "Große Straße 12, Halle · Old mill"
    for text in ("grosse strasse halle", "OLD MÍLL", told):
        assert suggest_buildings(None, bpy.context, text) == [(told, where)]
        assert bpy.ops.citypv.show_building(building=text) == {"FINISHED"}
        shown = read_face_attribute(city.data, "building")[read_selection(city.data)]
        assert set(shown) == {list(city["citypv_buildings"]).index(told)}
    assert len(suggest_buildings(None, bpy.context, "")) == 3
    run("show_building")

    # Months and hours of a building sum up to its energy of the year.
    face = int(np.flatnonzero(read_selection(city.data))[0])
    assert bpy.ops.citypv.probe(face=face, whole=True) == {"FINISHED"}
    months, curves = read_charts(city)
    assert months.sum() == pytest.approx(ranked["mwh_per_year"].iloc[0], rel=1e-4)
    assert curves[0].sum() * 365 / 1000 == pytest.approx(months.sum(), rel=0.003)
    assert curves[1].max() > curves[0].max() > curves[2].max() > 0
    assert curves[:, [0, 1, 23]].max() == 0
    assert 10 <= curves[0].argmax() <= 13


@pytest.mark.slow
def test_exports_that_cannot_be_written_say_why(city, tmp_path):
    nowhere, folder = tmp_path / "none" / "faces.csv", tmp_path / "faces.csv"
    refuse(
        "export", "there is no such folder; choose another", format="faces", filepath=str(nowhere)
    )
    folder.mkdir()
    refuse("export", "cannot be written", format="faces", filepath=str(folder))
    Session.of(city).scene = None
    said = "needs the geometry, which is not in this file; import and trace again"
    refuse("export", said, format="gltf", filepath=str(tmp_path / "city.glb"))
