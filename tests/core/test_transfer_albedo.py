"""A Transfer remembers which albedos and materials it was traced with, in memory, in its file and
in the summary.
"""

import numpy as np
import pytest
import xarray as xr
from scenes import join, strip, suns_towards

from citypv.core.light.trace_forward import trace_forward
from citypv.core.light.trace_gather import trace_gather
from citypv.core.patches.materials import MaterialSpec
from citypv.core.results.transfer_file import SUMS, read_transfer, write_transfer
from citypv.core.settings.errors import InputError
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request

SUNS = suns_towards([[0, -1, 1], [0, 0, 1]])
TEXT = "surface,albedo,material\ns1,0.7,\nfacade,,tile\ns2,0.6,mirror\n"


def street():
    """A facade s0, s1 and a street s2, s3 before it, of the materials Backstein and nothing."""
    scene = join(
        [strip([0, 0, 0], [20, 0, 0], [0, 0, 10], 1), strip([0, -8, 0], [20, 0, 0], [0, 8, 0], 1)]
    )
    scene.surfaces.material = ["Backstein", "Backstein", "", "unknown"]
    return scene


def trace(tmp_path, text=TEXT, trace=trace_forward, **settings):
    path = tmp_path / "finish.csv"
    path.write_text(text)
    estimator = {trace_forward: "forward", trace_gather: "gather"}[trace]
    request = Request(
        albedo=0.4, samples=16, estimator=estimator, albedo_file=str(path), **settings
    )
    return trace(street(), SUNS, request, silent)


def test_albedo_and_material_of_every_surface(tmp_path):
    transfer = trace(tmp_path, materials={"Backstein": MaterialSpec(0.31)})
    assert transfer.albedo == pytest.approx([0.31, 0.7, 0.6, 0.4])
    assert transfer.material == ["Backstein", "", "mirror", ""]
    dull = trace(tmp_path, "surface,albedo,material\nfacade,,tile\n", trace_gather)
    assert dull.albedo == pytest.approx([0.225, 0.225, 0.4, 0.4])
    assert dull.material == ["tile", "tile", "", ""]
    rows = {(row["from"], row["material"]): (row["surfaces"], row["area"]) for row in dull.albedos}
    assert rows == {
        ("--albedo-file", "tile"): (2, pytest.approx(200)),
        ("--albedo", ""): (2, pytest.approx(160)),
    }
    part = transfer.take(np.array([2, 0]))
    assert (part.albedo.tolist(), part.material) == ([0.6, 0.31], ["mirror", "Backstein"])


@pytest.mark.slow
def test_the_file_tells_them_with_units_and_names(tmp_path):
    transfer = trace(tmp_path)
    write_transfer(tmp_path / "transfer.nc", transfer)
    with xr.open_dataset(tmp_path / "transfer.nc") as dataset:
        assert dataset["albedo"].dims == dataset["material"].dims == ("surface",)
        np.testing.assert_array_equal(dataset["albedo"], transfer.albedo)
        assert dataset["material"].to_numpy().tolist() == ["tile", "", "mirror", ""]
        for name in ("albedo", "area", "sky_view_factor", "visible_share", "direct_reflected"):
            assert dataset[name].attrs["units"] and dataset[name].attrs["long_name"]
        assert "traced as" in dataset["material"].attrs["long_name"]
    again = read_transfer(tmp_path / "transfer.nc")
    np.testing.assert_array_equal(again.albedo, transfer.albedo)
    assert (again.material, again.albedos) == (transfer.material, transfer.albedos)


@pytest.mark.slow
def test_files_of_before_are_still_read(tmp_path):
    """They tell nothing of albedos, and all else as ever; one that tells half of it is refused."""
    write_transfer(tmp_path / "transfer.nc", trace(tmp_path))
    with xr.load_dataset(tmp_path / "transfer.nc") as dataset:
        old = dataset.drop_vars(["albedo", "material"])
        del old.attrs["albedos"], old.attrs[SUMS]
        old.to_netcdf(tmp_path / "old.nc")
        spoilt = {
            "half": dataset.drop_vars("material"),
            "garbled": dataset.assign_attrs(albedos="["),
        }
        spoilt["turned"] = dataset.assign(albedo=("sun", [0.1, 0.2]))
        for name, one in spoilt.items():
            one.to_netcdf(tmp_path / f"{name}.nc")
    transfer = read_transfer(tmp_path / "old.nc")
    assert (transfer.albedo, transfer.material, transfer.albedos) == (None, None, None)
    assert len(transfer.surfaces) == 4
    for name in spoilt:
        with pytest.raises(InputError, match=f"{name}.nc: "):
            read_transfer(tmp_path / f"{name}.nc")
