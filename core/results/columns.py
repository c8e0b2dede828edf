"""Columns of results: one name, unit and meaning per result in all output files.

faces.csv, transfer.nc, the semantic surfaces of CityJSON and the face attributes in Blender are
written from this table. A new result needs one line here, and a field in the dataclass that
contains it.
"""

from dataclasses import dataclass

import numpy as np

from ..settings.errors import cell_of_id

# columns whose texts come from the files of a city
IDS = ("surface_id", "building_id", "address", "name", "function")


@dataclass(frozen=True)
class Column:
    """One result per surface."""

    name: str  # of the field, and in every file
    owner: str  # dataclass that contains it: surfaces, transfer or energy
    meaning: str
    unit: str = "1"  # by the CF conventions, "1" if dimensionless
    kind: str = "number"  # text, flag or number
    title: str = ""  # in a legend; "" if Blender does not show it as colours
    legend_unit: str = ""  # as people write it
    tabled: bool = True  # whether faces.csv has it
    stored: bool = False  # whether transfer.nc has it

    def values_of(self, transfer, energy):
        """Values of a column, (n,): a list of str, or an array of bool or float."""
        carriers = {"surfaces": transfer.surfaces, "transfer": transfer, "energy": energy}
        values = getattr(carriers[self.owner], self.name)
        return np.asarray(values, float) if self.kind == "number" else values


COLUMNS = (
    Column("surface_id", "surfaces", "identifier of the polygon", "", "text", stored=True),
    Column(
        "building_id", "surfaces", "identifier of the top-level building", "", "text", stored=True
    ),
    Column(
        "thematic",
        "surfaces",
        "class in the file: WallSurface, RoofSurface, …",
        "",
        "text",
        tabled=False,
        stored=True,
    ),
    Column(
        "kind",
        "surfaces",
        "facade, roof, flat, steep, downward, ground or rack",
        "",
        "text",
        stored=True,
    ),
    Column(
        "orientation",
        "surfaces",
        "one of eight directions, north to northwest, or none",
        "",
        "text",
        stored=True,
    ),
    Column(
        "eligible",
        "surfaces",
        "facade or roof by its shape, or rack",
        kind="flag",
        tabled=False,
        stored=True,
    ),
    Column(
        "eligible", "energy", "facade or roof that modules may be mounted on, or rack", kind="flag"
    ),
    Column("area", "surfaces", "area without holes", "m2", stored=True),
    Column(
        "open_area",
        "energy",
        "area neither inside nor under buildings, with room for modules before it",
        "m2",
    ),
    Column("module_area", "energy", "area of the modules on it", "m2"),
    Column(
        "module_count",
        "energy",
        "modules on it; cells of a grid and usable shares have parts of modules",
    ),
    Column("kwp", "energy", "nominal power of modules on it", "kW"),
    Column(
        "reason",
        "energy",
        "why it carries no modules, a key of `core.energy.counted_area.REASONS`; empty where it "
        "does",
        "",
        "text",
    ),
    Column("reason_note", "energy", "words of the user on the reason", "", "text"),
    Column("surface_tilt", "surfaces", "tilt from the horizontal", "degree", stored=True),
    Column(
        "surface_azimuth", "surfaces", "azimuth clockwise from true north", "degree", stored=True
    ),
    Column("covered_share", "transfer", "share that lies inside or under buildings", stored=True),
    Column(
        "sky_view_factor",
        "transfer",
        "cosine-weighted free share of the sky",
        title="Sky view factor",
        stored=True,
    ),
    Column(
        "far_ground_view_factor",
        "transfer",
        "share of the hemisphere that meets open ground beyond the scene",
        tabled=False,
        stored=True,
    ),
    Column(
        "diffuse_relative",
        "transfer",
        "irradiance per DHI, reflections included",
        title="Diffuse irradiance per DHI",
        stored=True,
    ),
    Column(
        "diffuse_relative_standard_error",
        "transfer",
        "standard error of diffuse_relative",
        stored=True,
    ),
    Column(
        "direct_annual_standard_error",
        "transfer",
        "standard error of the annual mean irradiance per DNI",
        tabled=False,
        stored=True,
    ),
    Column(
        "direct_relative_annual",
        "energy",
        "mean irradiance per DNI of all intervals with the sun above 2°, reflections included",
        title="Direct irradiance per DNI, annual mean",
    ),
    Column(
        "direct_relative_annual_standard_error",
        "energy",
        "standard error of direct_relative_annual",
    ),
    Column(
        "poa_global_annual",
        "energy",
        "irradiation in the plane of the surface per year",
        "kWh m-2",
        title="Irradiation in the plane of the surface",
        legend_unit="kWh/m² per year",
    ),
    Column(
        "full_load_hours",
        "energy",
        "full load hours per year, AC after losses",
        "h",
        title="Full load hours",
        legend_unit="h per year",
    ),
    Column(
        "full_load_hours_standard_error",
        "energy",
        "standard error of full_load_hours: rays, size of patches where it matters, choice of suns",
        "h",
        title="Standard error of the full load hours",
        legend_unit="h per year",
    ),
    Column("full_load_hours_dc", "energy", "full load hours per year, DC without losses", "h"),
    Column(
        "string_loss",
        "energy",
        "full load hours per year that strings of modules lose in shade, counted with --strings "
        "string only; empty where it is unknown",
        "h",
    ),
    Column(
        "edge_distance",
        "transfer",
        "from its middle along its normal in plan to the outline of the built area; none beyond "
        "100 m",
        "m",
        title="Distance to the edge of the city",
        legend_unit="m",
    ),
)


TABLED = tuple(one for one in COLUMNS if one.tabled)  # in faces.csv and CityJSON


def write_table(path, table):
    """Write a pandas.DataFrame as CSV, numbers with six significant digits, ids as of
    `cell_of_id`.
    """
    ids = {name: [cell_of_id(str(one)) for one in table[name]] for name in IDS if name in table}
    table.assign(**ids).to_csv(path, index=False, lineterminator="\n", float_format="%.6g")


def name_months(by_month):
    """Columns of the months: full_load_hours_01 to _12, each (n,) [h]."""
    return {f"full_load_hours_{month + 1:02d}": by_month[:, month] for month in range(12)}
