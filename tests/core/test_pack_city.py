"""What report.html packs for its 3D view, unpacked again; and what the page allows to run."""

import base64
import hashlib
import json
import re
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import shapely

from citypv.core.city.grid_cells import Outlines
from citypv.core.energy.counted_area import CHOSEN, REASONS
from citypv.core.modules.lay_modules import ModuleLayout
from citypv.core.results import write_report
from citypv.core.results.pack_city import BELOW, pack_city, pack_shapes
from citypv.core.results.read_results import (
    FACE_NUMBERS,
    FACE_TEXTS,
    Results,
    check_columns,
    count_faces,
)
from citypv.core.settings.errors import InputError

WEB = Path(write_report.__file__).parent / "web"
SUMMARY = {
    "settings": {"module": "m", "hidden_walls": "leave-out", "usable": {"facade": 0.5}},
    "totals": {"kinds": {}, "kwp": 0.0, "mwh_per_year": 0.0},
    "weather": {"label": "w"},
}


def some_results(count=4, seed=0, **columns):
    """Results of box houses, five surfaces each and a floor, with random numbers of six digits."""
    rng, kinds = np.random.default_rng(seed), ["facade"] * 4 + ["flat", "ground"]
    sides, size = ["south", "east", "north", "west", "none", "none"], 6 * count
    low, high = np.zeros((count, 3)), rng.uniform(4, 30, (count, 3))
    low[:, 0], low[:, 1] = 40 * (np.arange(count) // 100), 40 * (np.arange(count) % 100)
    a, b, c, d, e, f, g, h = (
        np.where(np.array([k & 1, k & 2, k & 4]) > 0, low + high, low)
        for k in (0, 1, 3, 2, 4, 5, 7, 6)
    )
    rings = [(a, b, f, e), (b, c, g, f), (c, d, h, g), (d, a, e, h), (e, f, g, h), (a, d, c, b)]
    points = np.stack([np.stack(ring, axis=1) for ring in rings], axis=1).reshape(-1, 3)
    numbers = {
        name: [float(f"{value:.6g}") for value in rng.uniform(10, 2000, size)]
        for name in ("area", "full_load_hours", "full_load_hours_standard_error")
    }
    faces = {
        "surface_id": [f"surface_{k:06d}" for k in range(size)],
        "building_id": np.repeat([f"building_{k:05d}" for k in range(count)], 6),
        "kind": kinds * count,
        "orientation": sides * count,
        "eligible": (["true"] * 4 + ["false"] * 2) * count,
        **numbers,
        "open_area": np.multiply(numbers["area"], rng.choice([1.0, 1.0, 0.75], size)),
        "surface_tilt": [90.0, 90.0, 90.0, 90.0, 0.0, 180.0] * count,
        "surface_azimuth": [180.0, 90.0, 0.0, 270.0, 0.0, 0.0] * count,
        "sky_view_factor": rng.uniform(0, 1, size).round(6),
    }
    faces["kwp"] = faces["open_area"] * np.array(([0.1] * 4 + [0.2, 0.0]) * count)
    faces["module_count"] = faces["kwp"] / 0.3
    faces["reason"] = ([""] * 5 + ["ground"]) * count
    outlines = Outlines(
        points.astype(np.float32), np.arange(0, 4 * size + 1, 4, np.int32), np.arange(size + 1)
    )
    groups = pd.DataFrame(columns=["kind", "orientation", "period", "index", "full_load_hours"])
    months = rng.uniform(0, 150, (size, 12)).astype(np.float32)
    faces = count_faces("faces.csv", pd.DataFrame(faces | columns), SUMMARY)
    return Results("R", faces, groups, SUMMARY, None, None, None, outlines, months)


def unpack(text):
    """Header and arrays of the data of a page."""
    data = zlib.decompress(base64.b64decode(text, validate=True), wbits=-15)
    size = int.from_bytes(data[:4], "little")
    found, place = json.loads(data[4 : 4 + size]), 4 + size
    for entry in found["arrays"]:
        count = entry["count"]
        number = (
            np.frombuffer(data[place : place + 4 * count], np.uint8).reshape(4, count).T.tobytes()
        )
        values = np.frombuffer(number, "<i4" if entry["whole"] else "<f4")
        found[entry["name"]] = np.cumsum(values) if entry["whole"] else values
        place += 4 * count
    assert place == len(data)
    return found


def test_numbers_come_out_as_they_are_in_the_tables():
    results = some_results()
    city, faces = unpack(pack_city(results)), results.faces
    wall, roof, floor = 0, 4, 5
    assert city["surface_id"] == faces["surface_id"].tolist()
    assert [city["buildings"][k] for k in city["building"]] == faces["building_id"].tolist()
    assert [city["kinds"][k]["name"] for k in city["kind"]] == faces["kind"].tolist()
    assert [city["sides"][k] for k in city["orientation"]] == faces["orientation"].tolist()
    assert (city["area"] == faces["area"].to_numpy(np.float32)).all()  # whole float32
    for row, usable in ((wall, 0.5), (roof, 1.0)):
        one = faces.iloc[row]
        assert city["counted"][row] == pytest.approx(one.open_area)
        assert city["kwp"][row] == pytest.approx(usable * one.open_area / 5)
        for name, column in (
            ("hours", "full_load_hours"),
            ("error", "full_load_hours_standard_error"),
        ):
            assert city[name][row] * one.open_area == pytest.approx(one[column] * one.area)
        assert city["month_02"][row] * one.open_area == pytest.approx(
            results.months[row, 1] * one.area
        )
    assert city["kwp"][floor] == city["counted"][floor] == 0 and np.isnan(city["month_02"][floor])
    assert [city["reasons"][city["reason"][row]] for row in (wall, floor)] == [
        "",
        REASONS["ground"],
    ]
    assert city["reason"][roof] == 1


def test_modules_come_out_where_they_lie():
    """Two modules on a wall to the south, 5 cm before it, and one on a slope."""
    along, up = [[1.65, 0, 0], [1.65, 0, 0], [0, 1, 0]], [[0, 0, 1.0], [0, 0, 1.0], [-0.8, 0, 0.6]]
    corner = [[0.1, 0, 3], [1.77, 0, 3], [5, 6, 7]]
    layout = ModuleLayout(np.array([0, 0, 4]), *map(np.array, (corner, along, up)), np.zeros(3))
    results = replace(some_results(), layout=layout)
    city = unpack(pack_city(results))
    assert city["module_surface"].tolist() == [0, 0, 4]
    low = np.reshape(city["module_corner"], (3, 3)).T / 1000
    assert low[:2] == pytest.approx(np.array([[0.1, -0.05, 3], [1.77, -0.05, 3]]), abs=1e-3)
    assert low[2] - corner[2] == pytest.approx([0.03, 0, 0.04], abs=1e-3)  # along its normal
    for name, edges in (("along", along), ("up", up)):
        found = np.reshape(city[f"module_{name}"], (3, 3)).T / 1000
        assert found == pytest.approx(np.array(edges), abs=2e-3)
    assert "module_surface" not in unpack(pack_city(results, with_modules=False))


def test_hours_are_those_of_the_area_that_counts():
    results = some_results()
    whole = {"settings": {"hidden_walls": "count"}}
    count_all = replace(results, faces=count_faces("faces.csv", results.faces, whole))
    assert unpack(pack_city(count_all))["hours"][:5] == pytest.approx(
        results.faces["full_load_hours"][:5].to_numpy()
    )


@pytest.mark.parametrize("reason", REASONS)
def test_what_does_not_count_says_why(reason):
    results = some_results(reason=[reason] * 24, kwp=0.0)
    city = unpack(pack_city(results))
    assert city["reasons"][city["reason"][0]] == REASONS[reason]
    # What the user leaves out has an area of which its hours are, but no modules.
    assert city["counted"].all() == (reason in CHOSEN)
    assert not city["kwp"].any() and np.isnan(city["month_01"]).all()


def test_a_table_of_another_version_is_refused():
    with pytest.raises(InputError, match=r"faces\.csv: has the reason 'new', which is not known"):
        some_results(reason=["new"] * 24)
    earlier = some_results().faces.drop(columns=["kwp", "reason"])
    with pytest.raises(
        InputError, match="no column reason, reason_note, kwp; compute the folder again, by"
    ):
        check_columns("faces.csv", earlier, FACE_TEXTS, FACE_NUMBERS)


def test_a_change_has_zero_in_the_middle():
    results, rng = some_results(20), np.random.default_rng(2)
    # the last is gone
    names = pd.concat([results.faces["building_id"], results.faces["building_id"].iloc[:1]])
    hours, energy = rng.normal(0, 50, (2, 121))
    change = pd.DataFrame(
        {"building_id": names.to_numpy(), "full_load_hours_change": hours, "mwh_change": energy}
    )
    change[["full_load_hours_change_standard_error", "mwh_change_standard_error"]] = 1.0
    change.loc[0, "full_load_hours_change"] = np.nan  # new
    city = unpack(pack_city(results, change))
    change["place"] = [city["buildings"].index(name) for name in names]
    sums = [change["mwh_change"][change["place"] == place].sum() for place in range(20)]
    assert city["building_change"] == pytest.approx(sums, rel=1e-5)
    assert city["building_change_error"][change["place"][0]] == pytest.approx(
        7**0.5
    )  # six of it, and the one gone
    change = change.iloc[:120]
    layer = city["layers"][0]
    assert layer["name"] == "change" and layer["range"][0] == -layer["range"][1] < -100
    assert layer["stops"][8] == "#ebebeb"  # of the middle
    assert city["change"] == pytest.approx(
        change["full_load_hours_change"].to_numpy(np.float32), nan_ok=True
    )


def test_triangles_cover_the_surfaces_and_the_ground_lies_below():
    """A square with a hole: 16 - 4 m² by shapely; surfaces without rings, as behind old files, have
    no triangles.
    """
    square = np.array([[0, 0, 5], [4, 0, 5], [4, 4, 5], [0, 4, 5]], np.float32)
    points = np.concatenate([square, square[::-1] / 2 + [1, 1, 2.5]])
    outlines = Outlines(points, np.array([0, 4, 8]), np.array([0, 0, 2]))
    shapes = pack_shapes(outlines, np.array([0, 0]))
    corners = shapes["corners"].T / 1000
    area = sum(shapely.Polygon(corners[triangle][:, :2]).area for triangle in shapes["triangles"])
    assert area == pytest.approx(12)
    assert shapes["plate"] == pytest.approx(5 - BELOW)
    west, east, south, north = shapes["plate_bounds"]
    assert west < 0 and south < 0 and east > 4 and north > 4


@pytest.fixture
def compose(monkeypatch, tmp_path):
    """The page of some results, without its other parts."""
    monkeypatch.setattr(write_report, "_compose_body", lambda results, *parts: parts[0])
    (tmp_path / "summary.json").touch()  # its date is that of the results
    return lambda results: write_report.write_report(tmp_path, results).read_text("utf-8")


def test_a_city_that_is_too_large_says_so(compose, monkeypatch):
    monkeypatch.setattr(write_report, "MOST_DATA", 100)
    page = compose(some_results())
    assert "too large" in page and "24 surfaces" in page
    assert "script-src 'none'" in page and "<script" not in page


@pytest.mark.slow
def test_the_size_of_a_large_city():
    """15 MB for 100,000 surfaces are 1.5 for 10,000; three.js and the viewer come once."""
    assert len(pack_city(some_results(1667))) < 1_500_000
    parts = ("three.js", "viewer.js", "report.js", "viewer.css")
    assert sum(len((WEB / name).read_bytes()) for name in parts) < 600_000
    assert (
        sum(
            len((WEB / f"{name}.js").read_bytes()) for name in ("viewer", "supply", "report", "map")
        )
        < 60_000
    )


def test_the_bundle_is_what_its_notes_say():
    notes = (WEB / "three.LICENSES.txt").read_text(encoding="utf-8")
    for name in ("tiles.js", "three.js"):
        code = (WEB / name).read_bytes()
        assert f"sha256 of {name}: {hashlib.sha256(code).hexdigest()}\n" in notes
        assert not re.search(rb"\beval\(|new Function", code)
    licence = notes[notes.index("The MIT License") :].strip()
    assert licence in code.decode("ascii")
    assert not re.search(
        r"</script|<!--|\beval\(|new Function|\bfetch\(|XMLHttpRequest|import\(",
        code.decode("ascii"),
    )
