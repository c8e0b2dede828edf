"""Columns of results: one name, unit and meaning per result in all output files.

faces.csv, transfer.nc, the semantic surfaces of CityJSON and the face attributes in Blender are written from this
table. A new result needs one line here, and a field in the dataclass that contains it.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Column:
    """One result per surface."""

    name: str  # of the field, and in every file
    owner: str  # dataclass that contains it: surfaces, transfer or energy
    kind: str  # text, flag or number
    unit: str  # by the CF conventions, "1" if dimensionless
    meaning: str
    title: str = ""  # in a legend; "" if Blender does not show it as colours
    legend_unit: str = ""  # as people write it
    tabled: bool = True  # whether faces.csv has it
    stored: bool = False  # whether transfer.nc has it


def _text(name, meaning, **more):
    return Column(name, "surfaces", "text", "", meaning, stored=True, **more)


_HOURS, _ENERGY = "h per year", "kWh/m² per year"
COLUMNS = (
    _text("surface_id", "identifier of the polygon"),
    _text("building_id", "identifier of the top-level building"),
    _text("thematic", "class in the file: WallSurface, RoofSurface, …", tabled=False),
    _text("kind", "facade, roof, flat, steep, downward, ground or rack"),
    _text("orientation", "north, east, south, west or none"),
    Column("eligible", "surfaces", "flag", "1", "facade or roof by its shape, or rack", tabled=False, stored=True),
    Column("eligible", "energy", "flag", "1", "facade or roof that modules may be mounted on, or rack"),
    Column("area", "surfaces", "number", "m2", "area without holes", stored=True),
    Column("open_area", "energy", "number", "m2", "area that lies neither inside nor under buildings"),
    Column("surface_tilt", "surfaces", "number", "degree", "tilt from the horizontal", stored=True),
    Column("surface_azimuth", "surfaces", "number", "degree", "azimuth clockwise from true north", stored=True),
    Column("covered_share", "transfer", "number", "1", "share that lies inside or under buildings", stored=True),
    Column(
        "sky_view_factor",
        "transfer",
        "number",
        "1",
        "cosine-weighted free share of the sky",
        title="Sky view factor",
        stored=True,
    ),
    Column(
        "far_ground_view_factor",
        "transfer",
        "number",
        "1",
        "share of the hemisphere that meets open ground beyond the scene",
        tabled=False,
        stored=True,
    ),
    Column(
        "diffuse_relative",
        "transfer",
        "number",
        "1",
        "irradiance per DHI, reflections included",
        title="Diffuse irradiance per DHI",
        stored=True,
    ),
    Column(
        "diffuse_relative_standard_error",
        "transfer",
        "number",
        "1",
        "standard error of diffuse_relative",
        stored=True,
    ),
    Column(
        "direct_annual_standard_error",
        "transfer",
        "number",
        "1",
        "standard error of the annual mean irradiance per DNI",
        tabled=False,
        stored=True,
    ),
    Column(
        "direct_relative_annual",
        "energy",
        "number",
        "1",
        "mean irradiance per DNI of all intervals with the sun above 2°, reflections included",
        title="Direct irradiance per DNI, annual mean",
    ),
    Column(
        "direct_relative_annual_standard_error",
        "energy",
        "number",
        "1",
        "standard error of direct_relative_annual",
    ),
    Column(
        "poa_global_annual",
        "energy",
        "number",
        "kWh m-2",
        "irradiation in the plane of the surface per year",
        title="Irradiation in the plane of the surface",
        legend_unit=_ENERGY,
    ),
    Column(
        "full_load_hours",
        "energy",
        "number",
        "h",
        "full load hours per year",
        title="Full load hours",
        legend_unit=_HOURS,
    ),
    Column(
        "full_load_hours_standard_error",
        "energy",
        "number",
        "h",
        "standard error of full_load_hours: rays, size of patches where it matters, choice of suns",
        title="Standard error of the full load hours",
        legend_unit=_HOURS,
    ),
    Column("specific_yield", "energy", "number", "kWh kWp-1", "AC energy per year and nominal power"),
)


def tabled_columns(energy):
    """Columns of faces.csv and CityJSON: those that a run has, list of Column."""
    return [one for one in COLUMNS if one.tabled and (one.owner != "energy" or getattr(energy, one.name) is not None)]


def column_values(column, transfer, energy):
    """Values of a column, (n,): a list of str, or an array of bool or float."""
    carriers = {"surfaces": transfer.surfaces, "transfer": transfer, "energy": energy}
    values = getattr(carriers[column.owner], column.name)
    return np.asarray(values, float) if column.kind == "number" else values
