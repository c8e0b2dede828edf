"""Files of many producers against counts and areas that independent scripts found."""

import gzip
import json
import pickle
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from thorough import mark_cases

from citypv.core.city.classify import measure_tilt
from citypv.core.city.polygons import measure_polygons
from citypv.core.read.read_city import read_city
from citypv.core.settings.errors import InputError

pytestmark = pytest.mark.every_python

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data" / "citygml"
EXPECTED = json.loads((DATA / "expected.json").read_text(encoding="utf-8"))
US_FOOT = 1200 / 3937  # [m]
# Counted in the file, but left out for want of area; the file's own count of degenerate polygons.
DEGENERATE = {"ingolstadt_lod3_4018148.xml": 25}
SYSTEMS = {  # of files that spell it in different ways
    "berlin_3910_5817.gml": "EPSG:25833",
    "berlin_opendata_part_v1.gml": "EPSG:25833",
    "hannover_LGLN_LoD2_32_550_5802_3bld.gml": "EPSG:25832",
    "nrw_LoD2_32_280_5659_1_NW.gml": "EPSG:25832",
    "denhaag_1BwBP.gml": "EPSG:28992",
    "zurich_lod2_v1.xml": "EPSG:21781",
    "lyon_1er_small_house.gml": None,
}


def find(name):
    place = ROOT / "examples" / "berlin" / name
    if place.exists():
        return place
    return DATA / name if (DATA / name).exists() else DATA / f"{name}.gz"


@cache
def read_lod(name, lod, orient="auto"):
    return read_city(find(name), lod=lod, orient=orient)


def read_lods(name):
    """The city in every level of detail of its file."""
    return [read_lod(name, lod) for one, lod in CASES if one == name]


def measure(city):
    return measure_polygons(city.points, city.ring_start, city.polygon_start)


def scale(name):
    return US_FOOT**2 if name.startswith("nyc") else 1.0


CASES = [
    (name, lod)
    for name, e in EXPECTED.items()
    for lod in sorted({k[3:4] for k in e["area_by_lod_class"]})
]


@pytest.mark.parametrize(("name", "lod"), CASES)
def test_counts_and_areas_of_every_lod(name, lod):
    city, expected = read_lod(name, lod), EXPECTED[name]
    assert city.report.building_count == expected["buildings"]
    assert city.report.part_count == expected["parts"]
    area, _ = measure(city)
    thematic = np.array(city.thematic)
    classes = {
        k.split(":")[1]: v
        for k, v in expected["area_by_lod_class"].items()
        if k.startswith(f"lod{lod}")
    }
    assert sum(count for count, _ in classes.values()) == len(city)
    for name_of_class, (count, square_metres) in classes.items():
        chosen = thematic == (name_of_class if name_of_class != "None" else "")
        assert chosen.sum() == count
        assert area[chosen].sum() == pytest.approx(square_metres * scale(name), rel=1e-3, abs=0.06)


@pytest.mark.parametrize("name", mark_cases(EXPECTED, kept=8))
def test_every_polygon_is_met_and_counted_once(name):
    city = read_city(find(name))
    assert name not in SYSTEMS or city.crs == SYSTEMS[name]
    assert sum(city.report.lods_met.values()) == EXPECTED[name]["polygons"]
    assert len(set(city.surface_id)) == len(city)
    left_out = [names for names in city.report.skipped.values() if name in DEGENERATE]
    assert (
        sum(city.report.lods_chosen.values()) - len(city)
        == DEGENERATE.get(name, 0)
        == sum(map(len, left_out))
    )
    assert all(identifier for names in left_out for identifier in names)


@pytest.mark.parametrize(
    "name", mark_cases([name for name, e in EXPECTED.items() if e["lod2_area_by_tilt"]], kept=6)
)
def test_area_by_tilt(name):
    area, normal = measure(read_lod(name, "2", orient="as-drawn"))
    tilt, _ = measure_tilt(normal)
    bounds = {
        "up": (0, 1),
        "roof<15": (1, 15),
        "roof15-60": (15, 60),
        "60-89": (60, 89),
        "wall": (89, 91),
    }
    for word, (low, high) in {**bounds, "down": (91, 180.1)}.items():
        expected = EXPECTED[name]["lod2_area_by_tilt"].get(word, 0.0) * scale(name)
        assert area[(tilt >= low) & (tilt < high)].sum() == pytest.approx(
            expected, rel=1e-3, abs=0.5
        )


@pytest.mark.parametrize(
    "name", [n for n in EXPECTED if not n.startswith(("plateau", "nyc", "ingolstadt"))]
)
def test_bounds_are_those_of_the_points_not_of_the_envelope(name):
    points = np.concatenate([city.points for city in read_lods(name)])
    assert points.min(axis=0) == pytest.approx(EXPECTED[name]["min"], abs=2e-3)
    # One of them names its envelope.
    highest = EXPECTED[name]["max"] if name != "synthetic_100bld_v1.gml" else [96, 98, 12]
    assert points.max(axis=0) == pytest.approx(highest, abs=2e-3)


@pytest.mark.slow
def test_holes_are_kept():
    for name, e in EXPECTED.items():
        total = sum(len(city.ring_start) - 1 - len(city) for city in read_lods(name))
        # one hole belongs to a polygon without area
        lost = 1 if name.startswith("ingolstadt") else 0
        assert e["holes"] - total in (0, lost), name


@pytest.mark.parametrize("name", EXPECTED)
def test_bent_polygons_are_reported(name):
    words = "bent by more than 5 cm, triangulated as drawn"
    bent = sum(len(city.report.repaired.get(words, [])) for city in read_lods(name))
    assert bent == EXPECTED[name]["nonplanar_gt_5cm"]


@pytest.mark.slow
def test_best_of_lod_2_by_default_and_never_two_at_once():
    assert read_city(find("hamburg_CS2_multiLOD.gml")).report.lods_chosen == {"2": 21}
    assert read_city(find("delft_lod1_v2.xml")).report.lods_chosen == {"1": 91}
    assert read_city(find("ingolstadt_lod3_4018148.xml")).report.lods_chosen == {"3": 259}
    plateau = read_city(find("plateau_yokosuka_52397519_bldg.gml"))
    assert plateau.report.lods_chosen == {"1": 152, "2": 582}
    kinds = {}
    for building, thematic in zip(plateau.building_id, plateau.thematic, strict=True):
        # only LoD 2 has thematic surfaces there
        kinds.setdefault(building, set()).add(bool(thematic))
    assert all(len(met) == 1 for met in kinds.values())


def test_folder_and_several_files_are_one_city(tmp_path):
    shutil.copy(find("denhaag_1BwBP.gml"), tmp_path / "b.gml")
    with gzip.open(tmp_path / "a.gml.gz", "wb") as packed:
        packed.write(
            find("denhaag_1BwBP.gml")
            .read_bytes()
            .replace(b"GUID_7F9", b"GUID_XXX")
            .replace(b"UUID", b"UVID")
        )
    city = read_city(tmp_path)
    alone = pickle.loads(pickle.dumps(read_city(find("denhaag_1BwBP.gml"))))
    assert len(city) == 2 * len(alone)
    assert len(set(city.building_id)) == 2
    assert city.building_id[0].startswith("GUID_XXX")  # the order of the names
    assert len(read_city([tmp_path / "b.gml", tmp_path / "a.gml.gz"])) == len(city)

    # The same building in two tiles counts once.
    shutil.copy(tmp_path / "b.gml", tmp_path / "a.gml")
    city = read_city([tmp_path / "a.gml", tmp_path / "b.gml"])
    assert len(city) == len(alone) == 39
    assert city.report.skipped == {"building already read": [city.building_id[0]]}


def test_files_in_two_systems_are_refused():
    with pytest.raises(InputError, match=r"EPSG:25832.*convert all files"):
        read_city([find("denhaag_1BwBP.gml"), find("hannover_LGLN_LoD2_32_550_5802_3bld.gml")])


def test_missing_lod_names_those_met():
    with pytest.raises(InputError, match=r"no building has LoD 3 \(LoD met: 2\)"):
        read_city(find("denhaag_1BwBP.gml"), lod=3)
    with pytest.raises(InputError, match="not a level of detail"):
        read_city(find("denhaag_1BwBP.gml"), lod="9")
