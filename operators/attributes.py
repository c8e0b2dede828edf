"""What stands on the faces in Blender: names, codes, titles and units of the attributes.

Every attribute is called `citypv_` + name and lives on the faces (domain FACE).

| name | type | meaning |
|---|---|---|
| `surface` | INT | polygon of the city, the row of faces.csv; -1 on ground that was generated |
| `building` | INT | place in the list `citypv_buildings` of the object; on the city only |
| `kind`, `orientation` | INT | codes of `KIND_CODES` and `ORIENTATION_CODES`, also kept on the object |
| the names of `RESULTS` | FLOAT | NaN where there is no such result, as on generated ground |
"""

from dataclasses import dataclass

PREFIX = "citypv_"

KIND_CODES = {"facade": 0, "roof": 1, "flat": 2, "steep": 3, "downward": 4, "ground": 5}
ORIENTATION_CODES = {"none": 0, "north": 1, "east": 2, "south": 3, "west": 4}
CODES = {"kind": KIND_CODES, "orientation": ORIENTATION_CODES}


@dataclass(frozen=True)
class Quantity:
    """A result on the faces, as it is titled in a legend."""

    name: str
    title: str
    unit: str  # "" where it has none
    source: str  # "transfer" or "energy": the dataclass that carries it


QUANTITIES = (
    Quantity("sky_view_factor", "Sky view factor", "", "transfer"),
    Quantity("diffuse_relative", "Diffuse irradiance per DHI", "", "transfer"),
    Quantity("direct_relative_annual", "Direct irradiance per DNI, annual mean", "", "energy"),
    Quantity("poa_global_annual", "Irradiation in the plane of the surface", "kWh/m² per year", "energy"),
    Quantity("full_load_hours", "Full load hours", "h per year", "energy"),
    Quantity("full_load_hours_standard_error", "Standard error of the full load hours", "h per year", "energy"),
)
RESULTS = {quantity.name: quantity for quantity in QUANTITIES}
TITLES = {"kind": "Kind of surface", "orientation": "Orientation"} | {q.name: q.title for q in QUANTITIES}
