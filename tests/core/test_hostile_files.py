"""Files made to harm: they end in one line that names them, and nothing outside of them is read."""

import gzip
import os
import re
import subprocess
import sys

import h5py
import numpy as np
import pytest
import tifffile
from memory_of_reading import memory_of_refusal
from thorough import mark_cases
from weathers import ERA5

from citypv.__main__ import main
from citypv.core.city.build_scene import build_scene
from citypv.core.read.netcdf_file import open_netcdf, refuse_links
from citypv.core.read.open_geotiff import open_geotiff, unpack_bits
from citypv.core.read.open_input import open_input
from citypv.core.read.open_raster import open_raster, read_posts
from citypv.core.results.columns import write_table
from citypv.core.results.read_results import read_table
from citypv.core.run.run_log import print_output
from citypv.core.run.study import read_buildings
from citypv.core.settings import memory
from citypv.core.settings.errors import InputError, cell_of_id, id_of_cell
from citypv.core.settings.memory import check_memory, free_memory
from citypv.core.settings.request import Request
from citypv.core.weather.read_era5 import read_era5

pytestmark = pytest.mark.every_python

POSIX = pytest.mark.skipif(os.name != "posix", reason="pipes and limits of POSIX")


def link(file):
    file["t2m"] = h5py.ExternalLink("secret.h5", "values")


def link_in_group(file):
    file.create_group("inside")["t2m"] = h5py.ExternalLink("/etc/passwd", "values")


def virtual(file):
    layout = h5py.VirtualLayout((5,), "f8")
    layout[:] = h5py.VirtualSource("secret.h5", "values", (5,))
    file.create_virtual_dataset("t2m", layout)


def external(file):
    file.create_dataset("t2m", (5,), "f8", external=[("secret.bin", 0, 40)])


@pytest.mark.parametrize(
    ("write", "what"),
    [
        (link, "a link to another file, secret.h5"),
        (link_in_group, "a link to another file, /etc/passwd"),
        (virtual, "a virtual data set"),
        (external, "kept in another file"),
    ],
)
def test_values_of_other_files_are_not_read(tmp_path, monkeypatch, write, what):
    """The other file is there and could be read; the same numbers inside the file are."""
    monkeypatch.chdir(tmp_path)
    with h5py.File("secret.h5", "w") as file:
        file["values"] = np.arange(5.0)
    np.arange(5.0).tofile("secret.bin")
    with h5py.File("weather.nc", "w") as file:
        write(file)
    with pytest.raises(InputError, match=f"weather.nc: 't2m' is {what}"):
        open_netcdf("weather.nc")
    with h5py.File("plain.nc", "w") as file:
        group = file.create_group("inside")
        group["itself"], group["nothing"], file["t2m"] = (
            group,
            h5py.SoftLink("/nowhere"),
            np.arange(5.0),
        )
    refuse_links("plain.nc")


@pytest.mark.filterwarnings("ignore")  # of xarray, on times and names that make no sense
def test_damaged_weather_is_one_line(tmp_path):
    """Cut at seven places, and spoilt at twelve: it is read, or refused with its name."""
    data = ERA5.read_bytes()
    generator, refused = np.random.default_rng(5), 0
    cuts = [data[: len(data) * part // 8] for part in range(1, 8)]
    for place in generator.integers(0, min(len(data), 20_000), 6):
        cuts += [
            data[:place] + bytes(40) + data[place + 40 :],
            data[:place] + b"\xff" * 8 + data[place + 8 :],
        ]
    path = tmp_path / "era5.nc"
    for spoilt in cuts:
        path.write_bytes(spoilt)
        try:
            read_era5(path, 52.5, 13.4, 34.0, "nearest")
        except InputError as error:
            refused += 1
            assert str(path) in str(error) and "\n" not in str(error)
    assert refused >= 7


@POSIX
@pytest.mark.parametrize("option", ["CITY", "--weather", "--horizon", "--terrain", "--albedo-file"])
def test_a_pipe_is_refused_and_not_waited_for(tmp_path, city, refused, option):
    os.mkfifo(tmp_path / "pipe.gml")
    given = [tmp_path / "pipe.gml"] if option == "CITY" else [city, option, tmp_path / "pipe.gml"]
    assert "is a pipe or a device" in refused(
        "simulate", *given, "--out", tmp_path / "out", "--quiet"
    )


def test_a_name_that_no_file_system_takes_is_refused(tmp_path, city, refused):
    assert "cannot be read" in refused("inspect", tmp_path / f"{256 * 'x'}.gml")
    assert "cannot be used" in refused("simulate", city, "--out", tmp_path / (256 * "x"))


def test_control_characters_are_not_printed(tmp_path, refused, capfd):
    """Of a terminal they would clear the screen, or write its title; in JSON the words stay what
    they are.
    """
    name = "\x1b[2J\x9b31mred\u202e.gml"
    said = refused("inspect", tmp_path / name)
    assert r"\u001b[2J\u009b31mred\u202e.gml: no such file" in said
    with pytest.raises(InputError) as told:
        open_input(tmp_path / name)
    assert str(told.value).isprintable()
    print_output("one\n\x1btwo")
    assert capfd.readouterr().out == "one\n\\u001btwo\n"


@pytest.mark.parametrize("name", ["=1+1", "+49", "-3", "@sum", "'=1", "''@a"])
def test_ids_are_no_formulas_in_tables(tmp_path, name):
    cell = cell_of_id(name)
    assert cell == f"'{name}" and id_of_cell(cell) == name
    import pandas as pd

    ids = [name, "plain", "it's", "a=b", "", "'quoted'"]
    write_table(
        tmp_path / "faces.csv", pd.DataFrame({"surface_id": ids, "area": np.arange(-3.0, 3.0)})
    )
    lines = (tmp_path / "faces.csv").read_text().splitlines()
    assert lines[1] == f"'{name},-3" and lines[2:5] == ["plain,-2", "it's,-1", "a=b,0"]
    assert (
        read_table(tmp_path / "faces.csv", ("surface_id",), ("area",))["surface_id"].tolist() == ids
    )


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows tells no peak of memory this way")
def test_a_packed_mesh_has_the_budget_of_a_text(tmp_path):
    """150 kB that unpack to 13 million triangles, which would take 4 GB."""
    parts = [b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", *[b"f 1 2 3\n" * 2**16] * 200]
    (tmp_path / "bomb.obj.gz").write_bytes(gzip.compress(b"".join(parts)))
    problem, grown = memory_of_refusal(tmp_path / "bomb.obj.gz")
    assert "holds a mesh too large for memory: more than 0.8 GB" in problem and grown < 2**30


def test_packed_bits_are_unpacked_as_the_standard_says():
    """The example of TIFF 6.0, section 9 (Apple's); and never more than there is room for."""
    packed = bytes.fromhex("FE AA 02 80 00 2A FD AA 03 80 00 2A 22 F7 AA")
    expected = bytes.fromhex(
        "AA AA AA 80 00 2A AA AA AA AA 80 00 2A 22 AA AA AA AA AA AA AA AA AA AA"
    )
    room = np.full(40, 7, np.uint8)
    assert unpack_bits(np.frombuffer(packed, np.uint8), room) == 24
    assert room[:24].tobytes() == expected and (room[24:] == 7).all()
    assert unpack_bits(np.frombuffer(packed, np.uint8), room[:5]) == 5
    assert (
        unpack_bits(np.frombuffer(packed[:4], np.uint8), room) == 4
    )  # cut within bytes as they are
    assert unpack_bits(np.frombuffer(b"\x80\x80\x81", np.uint8), room) == 0


def test_a_window_is_read_from_the_blocks_that_it_touches(tmp_path):
    """Every window of a raster in tiles of 16 cells, against the array itself."""
    heights = np.random.default_rng(2).integers(0, 900, (50, 70)).astype(np.int16)
    tifffile.imwrite(tmp_path / "a.tif", heights, tile=(16, 16), compression="zlib")
    tifffile.imwrite(tmp_path / "b.tif", heights, rowsperstrip=9)
    for name in ("a.tif", "b.tif"):
        with tifffile.TiffFile(tmp_path / name) as file:
            raster = open_geotiff(tmp_path / name, file)
            for first, last, west, east in [
                (0, 50, 0, 70),
                (3, 4, 69, 70),
                (15, 33, 16, 48),
                (17, 50, 1, 15),
            ]:
                np.testing.assert_array_equal(
                    raster.read_cells(first, last, west, east), heights[first:last, west:east]
                )


def test_a_small_raster_of_very_many_cells_is_refused(tmp_path):
    """A file of some hundred bytes that announces 4 · 10¹⁰ cells."""
    path = tmp_path / "large.tif"
    tifffile.imwrite(path, np.zeros((16, 16), np.uint8), tile=(16, 16))
    with open_raster(path) as raster:
        raster.width = raster.height = 200_000
        with pytest.raises(
            InputError,
            match=r"large.tif: has 200,000 x 200,000 cells around the city, an implausible",
        ):
            read_posts(raster, (0, 0, 200_000, 200_000), 100)


@POSIX
def test_what_limits_leave_is_what_is_free():
    """`ulimit -v` of 4 GB in a process of its own: free is the rest of it, and a larger step is
    refused by its file.
    """
    code = (
        "import re, resource\n"
        "from pathlib import Path\n"
        "from citypv.core.settings.memory import check_memory, free_memory\n"
        "resource.setrlimit(resource.RLIMIT_AS, (4 * 10**9,) * 2)\n"
        "size = 1024 * int(re.search(r'VmSize:\\s*(\\d+)', "
        "Path('/proc/self/status').read_text())[1])\n"
        "assert abs(free_memory() - (35 * 10**8 - size)) < 1e7  # half a GB is for libraries that "
        "are not loaded\n"
        "check_memory('city.obj', 'tracing', 1e9, 'cure')\n"
        "check_memory('city.obj', 'tracing 5 patches', 5e9, 'give tiles')\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    said = ended.stderr.strip().splitlines()[-1]
    assert re.search(
        r"city.obj: tracing 5 patches needs 5.0 GB of memory, and 3.[345] GB are free; give tiles",
        said,
    )
    assert 0 < free_memory() < 1e14
    check_memory("city.obj", "tracing", 1, "cure")


def test_a_scene_that_does_not_fit_is_refused_by_what_it_needs(city, monkeypatch):
    """1.8 kB for each corner of its polygons."""
    buildings = read_buildings([city], Request())
    needed = 1800 * len(buildings.points)
    monkeypatch.setattr(memory, "free_memory", lambda: needed + 1)
    assert len(build_scene(buildings).surfaces) == len(buildings)
    monkeypatch.setattr(memory, "free_memory", lambda: needed - 1)
    words = rf"{city.name}: a scene of {len(buildings)} surfaces needs 0.0 GB of memory, and 0.0 GB"
    with pytest.raises(InputError, match=words):
        build_scene(buildings)


@pytest.mark.slow
@POSIX
@pytest.mark.parametrize(
    "ends", mark_cases(["1>&-", "2>&- 1>&-", "1>/dev/full", "2>/dev/full"], kept=2)
)
def test_closed_and_full_outputs_are_no_traceback(tmp_path, city, ends):
    """Whatever is left of the streams: no traceback; a full disk is one line and status 1."""
    command = (
        f"{sys.executable} -c 'from citypv.__main__ import run_program; run_program()' inspect "
        f"{city} {ends}"
    )
    ended = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert "Traceback" not in ended.stderr and "Exception" not in ended.stderr
    full = ends == "1>/dev/full"
    assert ended.returncode == int("full" in ends)
    assert (
        ended.stderr.endswith("citypv: error: standard output: No space left on device\n")
        or not full
    )


@pytest.mark.slow
@POSIX
def test_a_full_disk_ends_a_plot_in_one_line(tmp_path, city):
    """Files may have 4 or 8 kB at most, so that a picture ends in its middle, as on a full disk."""
    results = tmp_path / "out"
    few = [
        "--latitude",
        "50",
        "--longitude",
        "8",
        "--weather",
        "clear-sky",
        "--samples",
        "16",
        "--suns",
        "days:2",
    ]
    assert main(["simulate", str(city), "--out", str(results), *few, "--quiet"]) == 0
    kept = {path.name for path in results.iterdir()}
    program = "from citypv.__main__ import run_program; run_program()"
    # What Python compiles meanwhile would be cut, too, and spoil the checkout.
    command = (
        f"export PYTHONDONTWRITEBYTECODE=1; ulimit -f 8; {sys.executable} -c '{program}' plot "
        f"{results}"
    )
    ended = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert "Traceback" not in ended.stderr
    said = ended.stderr.strip().splitlines()[-1]
    path = re.escape(str(results))
    assert re.match(
        rf"citypv: error: {path}\S+: cannot be written \(.+\): is the disk full\?$", said
    ), said
    assert {path.name for path in results.iterdir()} == kept  # no half of a picture
