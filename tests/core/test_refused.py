"""What means nothing is refused in one line that names it before anything is written, and before
files are read.
"""

from pathlib import Path

import pytest
from thorough import mark_cases
from weathers import BARROW, ERA5

DEM = Path(__file__).parents[1] / "data" / "terrain" / "dem_jacksboro_tn_wgs84.tif"
SIMULATE = [
    ("nowhere.gml", "nowhere.gml"),
    ("CITY --weather CITY", "small.gml"),
    ("CITY --weather nowhere.nc", "nowhere.nc"),
    ("CITY --albedo 1.5", "--albedo"),
    ("CITY --albedo-file nowhere.csv", "nowhere.csv"),
    ("CITY --module Nonesuch", "--module"),
    ("CITY --losses 100", "--losses"),
    ("CITY --usable facade=1.2", "facade=1.2"),
    ("CITY --usable ground=0.5", "'ground' carries no modules"),
    ("CITY --inverter nonesuch", "--inverter"),
    ("CITY --suns monthly", "--suns"),
    ("nowhere.gml --effects fog=on", "--effects"),
    ("CITY --effects aoi=on --effects aoi=off", "aoi is given as on and as off"),
    ("CITY --usable roof=1,roof=0.5", "roof is given as 1.0 and as 0.5"),
    ("CITY --latitude 91 --longitude 0", "--latitude"),
    ("CITY --weather ERA5 --latitude 10 --longitude 10", "era5"),
    ("--weather ERA5 CITY", "give it before options of several values"),
    ("CITY --colour red", "--colour"),
    ("CITY --racks tilt=80", "--racks: tilt=80 is no number in its range"),
    ("CITY --target-error 0", "--target-error"),
    ("CITY --target-error nan", "--target-error"),
    ("CITY --weather-place 91 0", "--weather-place"),
    ("CITY --weather-without temp", "--weather-without"),
    ("CITY --weather clear-sky ERA5", "clear-sky"),
    ("CITY --horizon DEM", "does not reach the site"),
    ("CITY --cluster lokal:2", "'lokal:2' is not known; give local:N"),
    ("CITY --cluster local:0", "asks for 0 workers"),
    ("CITY --cluster tcp://nowhere", "is not known"),
    ("CITY --cluster tcp://127.0.0.1:99999", "does not answer"),
    ("CITY --cluster serial --tile 0", "0 m is too small; give 20 m or more"),
    ("CITY --tile 100", "--tile: is for cities traced in tiles; give --cluster local:N"),
    ("CITY --cluster serial --target-error 1", "--target-error: is for runs without tiles"),
    ("CITY --cluster serial --estimator forward", "--estimator forward: traces whole cities only"),
    ("CITY --editable --cluster serial", "--editable: is for runs without tiles"),
    ("CITY --editable --target-error 1", "--editable: an editable run has one round"),
    ("CITY --editable --estimator forward", "gather"),
    ("nowhere.gml --weather nowhere.epw", "nowhere.epw: no such file"),
    ("nowhere.gml --weather empty.epw", "empty.epw: the file is empty"),
    ("nowhere.gml --weather words.epw", "words.epw: is not in a known weather format"),
]
FAR = "--pictures off --weather"
WORLD = [
    ("nothing.nc", "no such file"),
    ("unshaded unshaded", "two are called"),
    ("unshaded --mix berlin=1", "no environment"),
    ("unshaded --step 0", "no step"),
    ("unshaded --latitudes 20 10", "no range"),
    ("unshaded --years 2015", "typical year"),
    ("unshaded --losses 10", "--losses"),
    ("unshaded --weather BARROW missing.nc", "missing.nc"),
    ("unshaded --mix=", "--mix: the weights add up to 0"),
    ("unshaded mix=unshaded --mix unshaded=0.5,mix=0.5 --step 90", "is called 'mix'"),
    (
        "unshaded --weather clear-sky --off-land clear-sky",
        "--off-land: means nothing for clear-sky",
    ),
    (f"unshaded {FAR} BARROW --years 2003", "--years: means nothing for stations"),
    (f"unshaded {FAR} BARROW --off-land clear-sky", "--off-land: means nothing for stations"),
    (f"unshaded {FAR} ERA5 --off-land clear-sky", "--off-land: means nothing for gridded weather"),
    # Half of the places would be left out: they lie below 180°.
    (f"unshaded {FAR} ERA5 --longitudes 0 360", "-180 to 180"),
    (f"unshaded {FAR} ERA5 --longitudes nan 10", "-180 to 180"),
]


FILES = {  # beside the command: what means nothing as weather, as a horizon
    "empty.epw": "",
    "words.epw": "some words without meaning\n",
    "albedo.csv": "surface,material\nroof,mirror\n",
    "heights.asc": "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n",
    "mesh.obj": "v 0 0 0\n",
}


@pytest.fixture
def refusal(city, tmp_path, refused, monkeypatch):
    """Returns the one line that a command refuses words with; nothing is written."""
    monkeypatch.chdir(tmp_path)
    places = {"CITY": city, "ERA5": ERA5, "BARROW": BARROW, "DEM": DEM}
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")

    def refuse(words):
        said = refused(*(places.get(word, word) for word in words.split()))
        assert {path.name for path in tmp_path.iterdir()} == set(FILES)
        return said

    return refuse


@pytest.mark.parametrize(("words", "problem"), SIMULATE)
def test_a_run_that_cannot_be_meant(refusal, words, problem):
    """A bad weather file is refused before the city is read, which is not even there."""
    said = refusal(f"simulate {words} --out out --quiet")
    assert problem in said and ("nowhere.gml" in said) == ("nowhere.gml" in problem)


@pytest.mark.parametrize(("words", "problem"), WORLD)
def test_a_map_of_the_world_that_cannot_be_meant(refusal, words, problem):
    assert problem in refusal(f"world {words} --out out --quiet")


@pytest.mark.parametrize(
    "command", mark_cases(["simulate --out out", "effects", "accuracy"], kept=1)
)
@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        (
            "--estimator forward --effects sky-rays=off",
            "--effects: sky-rays=off is for gather only",
        ),
        (
            "--effects terrain-horizon=on",
            "--effects: terrain-horizon needs a horizon; give --horizon FILE",
        ),
        ("--albedo-file albedo.csv", "albedo.csv: line 2: mirror needs an albedo; give one"),
        ("--horizon nowhere.tif", "nowhere.tif: no such file"),
        ("--horizon albedo.csv", "albedo.csv: has neither two columns nor one"),
        ("--horizon heights.asc", "heights.asc: names no coordinate reference system"),
        (
            "--horizon mesh.obj",
            "mesh.obj: is a mesh or a city, from which no horizon is read; give heights",
        ),
    ],
)
def test_what_tracing_lacks_is_told_before_the_city_is_read(refusal, command, settings, problem):
    said = refusal(f"{command} nowhere.gml {settings}")
    assert said.startswith(f"citypv: error: {problem}") and "nowhere.gml" not in said
