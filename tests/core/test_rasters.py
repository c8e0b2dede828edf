"""Rasters against GDAL, which writes them: every way of storing, places, units, averages; and what
is not read.
"""

import gzip

import numpy as np
import pytest
import rasterio
from rasterio.enums import Resampling
from rasterio.transform import Affine
from rasterio.windows import Window
from thorough import mark_cases

from citypv.core.city.transform_crs import plane_of
from citypv.core.read import open_raster as opening
from citypv.core.read.open_raster import average_window, open_raster
from citypv.core.settings.errors import InputError

pytestmark = pytest.mark.every_python

SHAPE = (150, 211)
PLACE = Affine(2.0, 0.0, 390_000.0, 0.0, -2.0, 5_820_000.0)
SYSTEM = "EPSG:25833"


def make_heights(kind):
    """Waves with noise, runs and a gap."""
    rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
    random = np.random.default_rng(4)
    heights = 60 + 40 * np.sin(rows / 17) * np.cos(columns / 23) + random.normal(0, 0.5, SHAPE)
    heights[20:60, 30:90] = 80
    heights = heights.astype(kind)
    heights[100:104, 7:9] = 0
    return heights


def write_tiff(path, heights, **options):
    settings = {"crs": SYSTEM, "transform": PLACE, "nodata": 0, **options}
    rows, columns = heights.shape[-2:]
    bands = heights.reshape(-1, rows, columns)
    with rasterio.open(
        path,
        "w",
        driver="GTiff",
        width=columns,
        height=rows,
        count=len(bands),
        dtype=heights.dtype,
        **settings,
    ) as dataset:
        dataset.write(bands)
    return path


def assert_as_gdal(path, window=(3, 41, 150, 90), posts=(37, 50), rounding=1e-12):
    """The same place, reference system and heights as GDAL has, whole, in a window and averaged."""
    column, row, width, height = window
    with rasterio.open(path) as dataset, open_raster(path) as raster:
        scale, offset = dataset.scales[0], dataset.offsets[0]
        np.testing.assert_allclose(
            raster.matrix, np.reshape(dataset.transform[:6], (2, 3)), rtol=1e-12, atol=1e-9
        )
        assert (raster.width, raster.height) == (dataset.width, dataset.height)
        assert (raster.crs is None) == (dataset.crs is None)
        if raster.crs is not None:
            (plane, unit), (own, own_unit) = plane_of(dataset.crs.to_wkt()), plane_of(raster.crs)
            assert own.equals(plane, ignore_axis_order=True)
            assert own_unit == unit
        frame = Window(column, row, width, height)
        expected = (
            dataset.read(1, window=frame, masked=True).astype(float).filled(np.nan) * scale + offset
        )
        np.testing.assert_allclose(
            average_window(raster, window, (height, width)), expected, rtol=rounding
        )
        mean = dataset.read(
            1, window=frame, out_shape=posts, masked=True, resampling=Resampling.average
        )
        if mean.dtype.kind == "f":  # GDAL rounds means of whole numbers
            got = average_window(raster, window, posts)
            np.testing.assert_allclose(
                got, mean.astype(float).filled(np.nan) * scale + offset, rtol=2e-6
            )
        return raster


STRIPS, TILES = {"blockysize": 7}, {"tiled": True, "blockxsize": 64, "blockysize": 32}


@pytest.mark.parametrize(
    ("compress", "kind", "layout"),
    [
        ("none", "uint8", STRIPS),
        ("none", "float64", TILES),
        ("deflate", "int16", TILES),
        ("deflate", "float32", STRIPS),
        ("lzw", "uint8", TILES),
        ("lzw", "float64", STRIPS),
        ("lzw", "int16", STRIPS),
        ("packbits", "float32", TILES),
    ],
)
def test_each_way_of_storing_gives_the_heights_that_gdal_gives(compress, kind, layout, tmp_path):
    predictors = (1, 2, 3) if kind.startswith("float") else (1, 2)
    for predictor in predictors if compress in ("deflate", "lzw") else (1,):
        options = layout | ({"predictor": predictor} if predictor > 1 else {})
        path = tmp_path / f"{predictor}.tif"
        assert_as_gdal(write_tiff(path, make_heights(kind), compress=compress, **options))


@pytest.mark.parametrize(
    "options",
    mark_cases(
        [
            {"BIGTIFF": "YES"},
            {"ENDIANNESS": "BIG", "compress": "lzw", "predictor": 2},
            {"ENDIANNESS": "BIG", "compress": "deflate", "predictor": 3},
            {"crs": "EPSG:4326"},
            {"crs": None},
            {"crs": "EPSG:2263"},
            {"crs": "EPSG:25832+5783"},
            {"transform": Affine(1, 0.3, 5e5, 0.2, -1, 5e6)},
            {"nodata": None},
            {"tfw": "YES", "profile": "BASELINE", "crs": None},
        ],
        kept=4,
    ),
)
def test_variants(options, tmp_path):
    assert_as_gdal(write_tiff(tmp_path / "a.tif", make_heights("float32"), **options))


@pytest.mark.parametrize("interleave", ["pixel", "band"])
def test_the_first_of_several_bands_counts(interleave, tmp_path):
    bands = np.stack([make_heights("float32"), np.ones(SHAPE, np.float32)])
    assert_as_gdal(
        write_tiff(tmp_path / "a.tif", bands, interleave=interleave, compress="lzw", predictor=3)
    )


def test_tiles_that_are_left_out_are_gaps(tmp_path):
    heights = np.zeros((200, 300), np.float32)
    heights[150:, 200:] = 5
    path = write_tiff(
        tmp_path / "a.tif", heights, tiled=True, blockxsize=64, blockysize=64, SPARSE_OK="TRUE"
    )
    assert_as_gdal(path, (5, 6, 290, 190), (20, 30))


def test_scale_offset_unit_and_posts_instead_of_cells(tmp_path):
    path = write_tiff(tmp_path / "a.tif", make_heights("int16"))
    with rasterio.open(path, "r+") as dataset:
        dataset.scales, dataset.offsets, dataset.units = [0.1], [-5.0], ["ft"]
        dataset.update_tags(AREA_OR_POINT="Point")
    assert assert_as_gdal(path).unit == "ft"


def test_compressed_by_gzip(tmp_path):
    plain = write_tiff(tmp_path / "a.tif", make_heights("float32"), compress="lzw")
    packed = tmp_path / "b.tif.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    with open_raster(plain) as one, open_raster(packed) as other:
        np.testing.assert_array_equal(
            one.read_cells(0, 150, 0, 211), other.read_cells(0, 150, 0, 211)
        )


def test_a_grid_as_text_is_as_gdal_reads_it(tmp_path):
    heights = make_heights("float32")[:40, :50]
    head = "NCOLS 50\nnrows 40\nxllcenter 390000.5\nyllcenter 5820000\ncellsize 2\nNODATA_value 0\n"
    text = "\n".join(" ".join(f"{value:.3f}" for value in row) for row in heights)
    path = tmp_path / "a.asc"
    path.write_text(head + text)
    path.with_suffix(".prj").write_text(rasterio.crs.CRS.from_user_input(SYSTEM).to_wkt())
    assert_as_gdal(path, (3, 4, 40, 30), (7, 9), 1e-7)  # GDAL keeps such grids in single precision
    path.write_text(head.replace("cellsize 2", "dx 2\ndy 3") + text.replace("80.000", "8e1"))
    assert_as_gdal(path, (3, 4, 40, 30), (7, 9), 1e-7)  # GDAL keeps such grids in single precision


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"compress": "zstd"}, "is compressed by ZSTD"),
        ({"compress": "lerc"}, "is compressed by LERC"),
        (
            {"crs": "+proj=tmerc +lat_0=10 +lon_0=13.3 +k=1 +x_0=7 +ellps=bessel"},
            "has no EPSG code",
        ),
    ],
)
def test_a_rarer_kind_is_read_by_gdal_where_it_is_installed_and_else_refused(
    options, problem, tmp_path, monkeypatch
):
    path = write_tiff(tmp_path / "a.tif", make_heights("float32"), **options)
    assert_as_gdal(path)
    monkeypatch.setattr(opening.importlib.util, "find_spec", lambda name: None)
    with (
        pytest.raises(
            InputError, match=rf"a\.tif: .*{problem}.*; type: gdalwarp .*pip install rasterio"
        ) as told,
        open_raster(path),
    ):
        pass
    assert "\n" not in str(told.value)


@pytest.mark.thorough
def test_any_damage_is_one_line(tmp_path):
    """Bytes cut or changed anywhere: heights or one InputError, never another error."""
    random, refused = np.random.default_rng(1), 0
    for compress in ("lzw", "deflate", "packbits"):
        whole = write_tiff(
            tmp_path / "a.tif", make_heights("int16")[:30, :40], compress=compress
        ).read_bytes()
        for _ in range(60):
            data = bytearray(
                whole[: random.integers(8, len(whole))] if random.random() < 0.3 else whole
            )
            for place in random.integers(4, len(data), random.integers(0, 4)):
                data[place] = random.integers(256)
            path = tmp_path / "b.tif"
            path.write_bytes(data)
            try:
                with open_raster(path) as raster:
                    if raster.width * raster.height < 10**6:
                        raster.read_cells(0, raster.height, 0, raster.width)
            except InputError as error:
                assert "\n" not in str(error)
                refused += 1
    assert refused > 40
