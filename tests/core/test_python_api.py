"""CityPV from Python: the same files as the command line, settings that are honoured or refused,
light imports.
"""

import re
import runpy
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from small_city import house
from test_open_part import write_blocks
from thorough import mark_cases
from weathers import ERA5

import citypv
from citypv.__main__ import main
from citypv.core.commands.choose_settings import request_of_settings
from citypv.core.commands.python_api import Result
from citypv.core.results.read_results import read_summary
from citypv.core.results.write_summary import versions
from citypv.core.run.write_run import Output

FEW = {"weather": "clear-sky", "samples": 16, "shadow_samples": 4, "suns": "days:2", "threads": 1}
# Settings as options and in Python.
SETTINGS = {
    "few rays": ([], {}),
    "a preset, as the paper": (
        ["--preset", "draft", "--method", "paper"],
        {"preset": "draft", "method": "paper"},
    ),
    "effects, shares and losses": (
        [
            "--effects",
            "receivers=off",
            "perez=on",
            "--usable",
            "facade=0.6,roof=0.8",
            "--losses",
            "5",
        ],
        {
            "effects": {"receivers": False, "perez": True},
            "usable": {"facade": 0.6, "roof": 0.8},
            "losses": 5,
        },
    ),
    "a weather file and an inverter": (
        ["--weather", str(ERA5), "--inverter", "pvwatts"],
        {"weather": ERA5, "inverter": "pvwatts"},
    ),
}


@pytest.fixture(scope="module")
def result(city):
    return citypv.simulate(city, **FEW)


def options_of(settings):
    return [
        part
        for name, value in settings.items()
        for part in (f"--{name.replace('_', '-')}", str(value))
    ]


@pytest.mark.slow
@pytest.mark.parametrize("name", mark_cases(SETTINGS, kept=1, law=(0,)))
def test_the_same_files_as_the_command_line(name, city, tmp_path):
    options, settings = SETTINGS[name]
    common = {key: value for key, value in FEW.items() if key not in settings}
    assert (
        main(
            [
                "simulate",
                str(city),
                "--out",
                str(tmp_path / "a"),
                "--quiet",
                *options_of(common),
                *options,
            ]
        )
        == 0
    )
    found = citypv.simulate([city], out=tmp_path / "b", **common | settings)
    for table in ("faces.csv", "groups.csv", "buildings.csv"):
        assert (tmp_path / "a" / table).read_bytes() == (found.folder / table).read_bytes()
    told = read_summary(tmp_path / "a" / "summary.json")
    assert (
        told["settings"] == found.summary["settings"] and told["totals"] == found.summary["totals"]
    )


@pytest.mark.slow
def test_tables_are_those_of_the_files(result):
    expected = pd.read_csv(result.folder / "faces.csv")
    assert result.faces["full_load_hours"].to_numpy() == pytest.approx(
        expected["full_load_hours"], nan_ok=True
    )
    assert result.faces["eligible"].dtype == bool and result.faces["eligible"].any()
    annual = result.groups[result.groups["period"] == "annual"]
    with xr.open_dataset(result.folder / "timeseries.nc", engine="h5netcdf") as series:
        assert result.timeseries.identical(series.load())
    assert len(annual) <= result.timeseries.sizes["group"]
    assert set(result.faces["building_id"]) == set(result.buildings["building_id"])
    assert f"{result.summary['totals']['kwp']:,.0f} kWp" in repr(result)
    shown = result._repr_html_()
    assert "<table" in shown and "data:image/png;base64," in shown


def test_saved_and_read_again(result, tmp_path):
    saved = result.save(tmp_path / "mine")
    again = citypv.read_results(tmp_path / "mine")
    pd.testing.assert_frame_equal(again.faces, result.faces)
    assert again.summary == saved.summary
    with pytest.raises(citypv.InputError, match="is not empty"):
        result.save(tmp_path / "mine")
    (tmp_path / "mine" / "faces.csv").unlink()
    with pytest.raises(citypv.InputError, match=r"faces\.csv: there is no such file"):
        citypv.read_results(tmp_path / "mine")


@pytest.mark.slow
def test_another_weather_keeps_the_plant(city, tmp_path):
    first = citypv.simulate(city, **FEW | {"losses": 20.0, "sky": "isotropic"})
    again = first.with_weather("clear-sky", threads=1)
    np.testing.assert_allclose(
        again.faces["full_load_hours"], first.faces["full_load_hours"], rtol=1e-9
    )
    assert again.summary["settings"]["losses"] == 20
    more = first.with_weather(ERA5, losses=10, allow_distance=1e5)
    options = options_of(
        {"weather": ERA5, "losses": 10, "sky": "isotropic", "allow-distance": 1e5, "threads": 1}
    )
    assert (
        main(["yield", str(first.folder), "--out", str(tmp_path / "a"), "--quiet", *options]) == 0
    )
    assert (more.folder / "faces.csv").read_bytes() == (tmp_path / "a" / "faces.csv").read_bytes()
    (first.folder / "transfer.nc").unlink()
    with pytest.raises(citypv.InputError, match="no light to weigh again; simulate with exports"):
        first.with_weather("clear-sky")


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"sampels": 4}, "sampels: is not a setting here; did you mean samples?"),
        ({"gltf": True}, 'gltf: is not a setting here; give exports=["gltf"]'),
        ({"samples": "many"}, "samples: 'many' is not a number"),
        ({"samples": 3.5}, "--samples: 3.5 is not a whole"),
        ({"diffuse_iam": 1}, "diffuse_iam: 1 is not True or False"),
        ({"preset": "best"}, "--preset: 'best' is not known"),
        ({"effects": {"fog": True}}, "fog"),
        ({"exports": ("pdf",)}, "exports: 'pdf' is not known"),
        ({"tile": 100.0}, "--tile: is for cities traced in tiles"),
        ({"weather_place": 5}, "is not latitude and longitude"),
        ({"weather": 5}, "weather: 5 is not a path or a list of paths"),
        ({"samples": None}, "None is not a number"),
    ],
)
def test_what_cannot_be_honoured_is_refused(settings, words, city):
    with pytest.raises(citypv.InputError) as told:
        citypv.simulate(city, **FEW | settings)
    assert words in str(told.value)


@pytest.mark.parametrize(
    ("city", "words"),
    [
        ([], "city: is an empty list"),
        (None, "city: None is no path"),
        ([None], "city: None is no path"),
        (7, "city: 7 is no path"),
        (b"a.gml", "is no path"),
        ({"a.gml": 1}, "is no path"),
    ],
)
def test_what_is_no_city_is_refused(city, words):
    for call in (citypv.simulate, citypv.inspect):
        with pytest.raises(citypv.InputError) as told:
            call(city)
        assert words in str(told.value)


def test_settings_are_brought_to_their_declared_types():
    """As a summary writes them, and the next run reads them: whole numbers as degrees, numbers of
    numpy, paths.
    """
    given = {
        "latitude": 50,
        "longitude": np.float32(8.5),
        "samples": np.int64(64),
        "seed": 3.0,
        "far_ground": True,
    }
    given |= {
        "weather": Path("a.epw"),
        "terrain": Path("b.tif"),
        "weather_place": [50, 8],
        "usable": {"facade": 1},
    }
    request = request_of_settings(given)
    for name, expected in {
        "latitude": 50.0,
        "longitude": 8.5,
        "samples": 64,
        "seed": 3,
        "far_ground": True,
        "weather": "a.epw",
        "terrain": "b.tif",
        "weather_place": (50.0, 8.0),
        "usable": {"facade": 1.0},
    }.items():
        found = getattr(request, name)
        assert found == expected and type(found) is type(expected)
    assert type(request.weather_place[0]) is type(request.usable["facade"]) is float
    with pytest.raises(citypv.InputError, match=r"--samples: \d+ is out of range"):
        request_of_settings({"samples": 1e30})


def test_one_export_is_named_as_one_of_several():
    assert (
        Output(exports="cityjson").exports == Output(exports=["cityjson"]).exports == ("cityjson",)
    )


def test_every_library_that_a_number_depends_on_is_in_the_summary():
    """Those that pyproject.toml asks for, and scikit-learn, whose k-means tsam takes."""
    text = (Path(citypv.__file__).parent / "pyproject.toml").read_text(encoding="utf-8")
    needed = [
        re.split(r"[<>=]", line)[0] for line in tomllib.loads(text)["project"]["dependencies"]
    ]
    found = versions()
    assert {*needed, "scikit-learn", "python", "citypv"} <= found.keys()
    assert all(found[name] for name in needed)


@pytest.mark.thorough
def test_goals_are_honoured(city):
    aimed = citypv.simulate(city, **FEW | {"suns": "days:24", "target_error": 0.8})
    assert aimed.summary["traced"]["rounds"] > 1
    with pytest.raises(citypv.InputError, match=r"0\.001 s are too few: .* give --time-budget"):
        citypv.simulate(city, time_budget=0.001, weather="clear-sky", threads=1)


def test_a_city_is_inspected(city):
    found = citypv.inspect(city)
    assert found["report"]["building_count"] == 3
    with pytest.raises(citypv.InputError, match="samples: is not a setting here"):
        citypv.inspect(city, samples=4)


@pytest.mark.slow
def test_a_world_of_unshaded_walls(tmp_path):
    found = citypv.world(
        "unshaded", weather="clear-sky", step=30, latitudes=(0, 60), longitudes=(0, 30)
    )
    assert found.sizes["latitude"] == 3 and np.isfinite(found["full_load_hours"]).all()


@pytest.mark.filterwarnings("ignore:pandas infers:FutureWarning")  # of PyPSA
def test_capacity_factors_go_into_pypsa(city):
    """PyPSA gets the hours of each group, and no more power than its area allows."""
    pytest.importorskip("pypsa")
    example = runpy.run_path(str(Path(citypv.__file__).parent / "examples/pypsa_district.py"))
    result = citypv.simulate(city, usable={"facade": 0.6}, **FEW)
    network = example["build_network"](result)
    hours = result.groups[result.groups["period"] == "annual"].set_index(["kind", "orientation"])[
        "full_load_hours"
    ]
    plants = network.generators.query("p_nom_extendable")
    assert len(plants)
    for name in plants.index:
        assert network.generators_t.p_max_pu[name].sum() == pytest.approx(
            hours[tuple(name.split("_"))], rel=1e-4
        )
    assert plants["p_nom_max"].sum() == pytest.approx(result.summary["totals"]["kwp"], rel=1e-4)


@pytest.mark.slow
def test_another_state_of_a_city_stands_where_the_first_one_does(city, result, tmp_path):
    """A house 200 m away moves the middle of the city; where that is kept, only rays that meet the
    house change.
    """
    more = city.read_text(encoding="utf-8").replace(
        "</CityModel>", house("d", (200, 60), (9, 9, 9)) + "</CityModel>"
    )
    (tmp_path / "more.gml").write_text(more, encoding="utf-8")
    kept = citypv.simulate(tmp_path / "more.gml", **FEW, site_of=result.folder)
    moved = citypv.simulate(tmp_path / "more.gml", **FEW)
    first, last = (one.faces.set_index("surface_id")["sky_view_factor"] for one in (result, kept))
    assert (last[first.index] == first).sum() >= len(first) - 6 > len(first) / 2
    places = [one.summary["input"]["site"] for one in (result, kept, moved)]
    assert places[0] == places[1] != places[2]
    with pytest.raises(citypv.InputError, match=r"summary.json: there is no such file"):
        citypv.simulate(city, site_of=tmp_path, **FEW)
    (tmp_path / "local.obj").write_text("v 0 0 0\nv 9 0 0\nv 0 9 5\nf 1 2 3\n")
    with pytest.raises(citypv.InputError, match="its city is in another reference system"):
        citypv.simulate(tmp_path / "local.obj", site_of=result.folder, **FEW)


@pytest.mark.slow
def test_groups_without_orientation_have_plain_names(tmp_path):
    """`flat`, as in the tables; the names of version 0.2.0 are read as these."""
    result = citypv.simulate(
        write_blocks(tmp_path / "a.obj", cut=False), latitude=50, longitude=10, **FEW
    )
    names = result.timeseries["group"].to_numpy().tolist()
    assert "flat" in names and not any("none" in name for name in names)
    old = result.timeseries.assign_coords(
        group=[{"flat": "flat_none"}.get(name, name) for name in names]
    )
    old.to_netcdf(tmp_path / "timeseries.nc", engine="h5netcdf")
    assert Result(tmp_path).timeseries["group"].to_numpy().tolist() == names


@pytest.mark.slow
def test_areas_of_all_tables_agree(result):
    """Of faces.csv, groups.csv and the summary: what counts, and what does not, by whole surfaces
    and parts.
    """
    faces, totals = result.faces, result.summary["totals"]
    counted = faces[faces.eligible]
    annual = result.groups[result.groups["period"] == "annual"]
    assert totals["eligible_area"] == pytest.approx(counted.open_area.sum(), rel=1e-5)
    assert annual["area"].sum() == pytest.approx(counted.open_area.sum(), rel=1e-5)
    assert ((faces.kwp > 0) == (faces.reason == "")).all()
    assert faces.kwp.sum() == pytest.approx(totals["kwp"], rel=1e-5)
    left_out = dict(totals["without_modules"])
    for reason, own in faces[faces.reason != ""].groupby("reason"):
        found = {"count": len(own), "area": pytest.approx(own.area.sum(), rel=1e-5)}
        assert left_out[reason] == found and (own.reason_note == "").all()
    parts = left_out.pop("parts", {"count": 0, "area": 0.0})
    hidden = (counted.area - counted.open_area).clip(lower=0)
    assert parts["area"] == pytest.approx(hidden.sum(), abs=0.1)
    assert sum(one["count"] for one in left_out.values()) == (~faces.eligible).sum()
    assert sum(one["area"] for one in left_out.values()) == pytest.approx(
        faces[~faces.eligible].area.sum(), rel=1e-5
    )
