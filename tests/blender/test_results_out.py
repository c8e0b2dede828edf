"""Exports, best buildings and charts of the probe: the same numbers as in the tables of the command line."""

import json
import sqlite3
import sys
from contextlib import closing

import bpy
import numpy as np
import pandas as pd
import pytest
from steps import run

from citypv.core.light.transfer import take_rows
from citypv.core.study import compute_energy
from citypv.operators.attributes import read_face_attribute
from citypv.operators.result.compute_energy import read_best
from citypv.operators.result.export_results import FILES, FORMATS
from citypv.operators.result.probe_faces import read_charts
from citypv.operators.result.select_faces import read_selection
from citypv.operators.session import find_session


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
    for name in [
        name for name in sys.modules if name.startswith(("citypv.core.results.draw_", "citypv.core.results.picture"))
    ]:
        monkeypatch.delitem(sys.modules, name)
    assert bpy.ops.citypv.export(format="report", filepath=str(tmp_path / "plain.html")) == {"FINISHED"}
    plain = (tmp_path / "plain.html").read_text("utf-8")
    assert 'id="city-data"' in plain  # the city in 3D
    assert "no pictures" in plain and "data:image" not in plain and "Full load hours by kind" in plain

    # The best buildings are those of buildings.csv, in its order of energy.
    best, ranked = read_best(city), buildings.sort_values("mwh_per_year", ascending=False)
    assert [name for name, _, _ in best] == list(ranked["building_id"])
    assert [float(mwh) for _, _, mwh in best] == pytest.approx(list(ranked["mwh_per_year"]), abs=0.06)
    run("show_building")
    shown = read_face_attribute(city.data, "building")[read_selection(city.data)]
    assert set(shown) == {list(city["citypv_buildings"]).index(best[0][0])}
    with pytest.raises(RuntimeError, match="no building 'Castle'"):
        bpy.ops.citypv.show_building(building="Castle")

    # Months and hours of a building sum up to its energy of the year.
    face = int(np.flatnonzero(read_selection(city.data))[0])
    assert bpy.ops.citypv.probe(face=face, whole=True) == {"FINISHED"}
    months, curves = read_charts(city)
    assert months.sum() == pytest.approx(ranked["mwh_per_year"].iloc[0], rel=1e-4)
    assert curves[0].sum() * 365 / 1000 == pytest.approx(months.sum(), rel=0.003)
    assert curves[1].max() > curves[0].max() > curves[2].max() > 0
    assert curves[:, [0, 1, 23]].max() == 0
    assert 10 <= curves[0].argmax() <= 13


def test_a_part_of_a_transfer_has_the_hours_of_the_whole(city):
    session, rows = find_session(city), np.array([3, 5, 8, 20])
    part = compute_energy(take_rows(session.transfer, rows), session.weather, session.request)
    np.testing.assert_allclose(part.full_load_hours, session.energy.full_load_hours[rows], rtol=1e-4)


def test_exports_that_cannot_be_written_say_why(city, tmp_path):
    with pytest.raises(RuntimeError, match="there is no such folder; choose another"):
        bpy.ops.citypv.export(format="faces", filepath=str(tmp_path / "none" / "faces.csv"))
    folder = tmp_path / "faces.csv"
    folder.mkdir()
    with pytest.raises(RuntimeError, match="cannot be written"):
        bpy.ops.citypv.export(format="faces", filepath=str(folder))
    find_session(city).scene = None
    with pytest.raises(RuntimeError, match="needs the geometry, which is not in this file; import and trace again"):
        bpy.ops.citypv.export(format="gltf", filepath=str(tmp_path / "city.glb"))
