"""A damaged file is told as such, and an error of the code as one of the code."""

import gzip

import h5netcdf
import numpy as np
import pytest
from test_rasters import make_heights, write_tiff
from thorough import mark_cases
from transfers import unshaded_transfer
from weathers import BARROW, BERLIN, ERA5, POTSDAM_2018, PVGIS, STOCKHOLM, TMY3

from citypv.__main__ import main
from citypv.core.light import rays_file
from citypv.core.read import open_geotiff, open_raster
from citypv.core.results import surfaces_file, transfer_file
from citypv.core.results.netcdf_variables import write_variables
from citypv.core.settings.errors import InputError
from citypv.core.sun.sky_grid import sky_grid_suns
from citypv.core.weather import read_epw, read_era5, read_pvgis
from citypv.core.weather.read_weather import read_weather

BUGS = (TypeError("a bug"), KeyError("a bug"), AttributeError("a bug"))


def open_tiff(folder):
    with open_raster.open_raster(
        write_tiff(folder / "a.tif", make_heights("int16")[:30, :40])
    ) as raster:
        raster.read_cells(0, 2, 0, 2)


def read_traced(folder):
    transfer_file.write_transfer(folder / "a.nc", unshaded_transfer(sky_grid_suns(16), [90], [180]))
    transfer_file.read_transfer(folder / "a.nc")


READERS = {
    "station": (read_epw, "take_columns", lambda _: read_weather(BARROW, *BERLIN)),
    "PVGIS": (read_pvgis, "lay_intervals", lambda _: read_weather(PVGIS, *BERLIN)),
    "ERA5": (read_era5, "convert_era5", lambda _: read_weather(ERA5, *BERLIN)),
    "raster": (open_geotiff, "matrix_of_page", open_tiff),
    "cells": (open_geotiff, "unpack_segment", open_tiff),
    "transfer": (transfer_file, "make_transfer", read_traced),
}


@pytest.mark.parametrize("name", READERS)
def test_a_bug_is_no_damage(name, tmp_path, monkeypatch):
    module, function, read = READERS[name]
    for bug in BUGS:

        def fail(*_, bug=bug, **__):
            raise bug

        monkeypatch.setattr(module, function, fail)
        with pytest.raises(type(bug), match="a bug"):
            read(tmp_path)


def test_a_bug_beside_the_shapes_of_surfaces_is_no_damage(tmp_path):
    with h5netcdf.File(tmp_path / surfaces_file.NAME, "w") as file:
        file.attrs["title"] = surfaces_file.FORMAT
        names = ("surface_id", "direction", surfaces_file.MONTHLY)
        write_variables(file, {name: ("surface", np.zeros(3)) for name in names})
    for bug in BUGS:
        with pytest.raises(type(bug), match="a bug"), surfaces_file.open_surfaces(tmp_path):
            raise bug
    with h5netcdf.File(tmp_path / surfaces_file.NAME, "w") as file:
        file.attrs["title"] = surfaces_file.FORMAT
    with (
        pytest.raises(InputError, match="has no surface_id, direction"),
        surfaces_file.open_surfaces(tmp_path),
    ):
        pass


def test_a_bug_ends_with_its_traceback(city, tmp_path, monkeypatch, capfd):
    def fail(*_):
        raise KeyError("a bug")

    monkeypatch.setattr(read_epw, "take_columns", fail)
    options = ["--latitude", "52", "--longitude", "13", "--out", str(tmp_path / "out"), "--quiet"]
    assert main(["simulate", str(city), "--weather", str(BARROW), *options]) == 1
    said = capfd.readouterr().err
    assert "Traceback" in said and "damaged" not in said and "internal error" in said


def test_kept_rays_of_another_version_are_told(tmp_path):
    """A type with other fields, and an unknown one, are the file's; what builds them is not."""
    for tree in ({"type": "Rows", "fields": {"other": 1}}, {"type": "Nothing", "fields": {}}):
        with pytest.raises(ValueError, match=r"Rows|Nothing"):
            rays_file.decode(tree, {})


def damage(lines, way, random):
    """Lines of a file of which some are cut, missing, shuffled or hold a word, mostly in
    its head.
    """
    place, lines = int(random.integers(min(12, len(lines)))), list(lines)
    if way == "cut":
        return lines[: int(random.integers(1, len(lines)))]
    if way == "line":
        del lines[place]
    elif way == "bytes":
        lines[place] = bytes(random.permutation(np.frombuffer(lines[place], np.uint8)))
    else:
        sign = b"," if b"," in lines[place] else b" "
        fields = lines[place].split(sign)
        fields[int(random.integers(len(fields)))] = b"word"
        lines[place] = sign.join(fields[1:] if way == "field" else fields)
    return lines


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    mark_cases([BARROW, TMY3, STOCKHOLM, POTSDAM_2018, PVGIS], kept=3),
    ids=lambda path: path.name[:9],
)
def test_any_damage_of_weather_is_one_line(path, tmp_path):
    random, refused = np.random.default_rng(1), 0
    whole = gzip.decompress(path.read_bytes()).splitlines()
    for way in ("cut", "line", "bytes", "field", "word"):
        for number in range(2):
            damaged = tmp_path / f"{way}{number}.csv"
            damaged.write_bytes(b"\n".join(damage(whole, way, random)))
            try:
                read_weather(damaged, *BERLIN)
            except InputError as error:
                assert "\n" not in str(error)
                refused += 1
    assert refused
