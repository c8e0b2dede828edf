"""Face attributes in Blender: names, codes, titles and units.

Every attribute is called `citypv_` + name and lives on the faces (domain FACE).

| name | type | meaning |
|---|---|---|
| `surface` | INT | polygon of the city, the row of faces.csv; -1 on ground that was generated |
| `building` | INT | place in the list `citypv_buildings` of the object; on the city only |
| `kind`, `orientation` | INT | codes of `KIND_CODES` and `ORIENTATION_CODES`, also kept on the object |
| the names of `RESULTS` | FLOAT | NaN where there is no such result, as on generated ground |

Those of `VIEWS` exist in Blender only: moments of the timeline, and differences from the result kept as *before*.
"""

from ..core.results.columns import COLUMNS, Column

PREFIX = "citypv_"

KIND_CODES = {"facade": 0, "roof": 1, "flat": 2, "steep": 3, "downward": 4, "ground": 5, "rack": 6}
ORIENTATION_CODES = {"none": 0, "north": 1, "east": 2, "south": 3, "west": 4}
CODES = {"kind": KIND_CODES, "orientation": ORIENTATION_CODES}


def _view(name, owner, meaning, title, legend_unit):
    return Column(name, owner, meaning, "", title=title, legend_unit=legend_unit)


QUANTITIES = tuple(column for column in COLUMNS if column.title)  # results stored as face attributes
CHANGE = "change_of_"  # begins the name of a difference from the result kept as *before*
COMPARED = ("full_load_hours", "poa_global_annual", "sky_view_factor")
VIEWS = (
    _view(
        "direct_irradiance",
        "timeline",
        "direct irradiance at the frame's hour, reflections included",
        "Direct irradiance",
        "W/m²",
    ),
    _view("month_hours", "timeline", "full load hours of the frame's month", "Hours of the month", "h"),
    _view(
        "seconds_to_halve",
        "energy",
        "time of further rounds that halve the standard error of the full load hours; grey where none is enough",
        "Seconds to halve the standard error",
        "s",
    ),
    *(
        _view(
            CHANGE + one.name, one.owner, f"after minus before: {one.meaning}", f"Change: {one.title}", one.legend_unit
        )
        for one in QUANTITIES
        if one.name in COMPARED
    ),
)
RESULTS = {quantity.name: quantity for quantity in (*QUANTITIES, *VIEWS)}
TITLES = {"kind": "Kind of surface", "orientation": "Orientation"} | {q.name: q.title for q in RESULTS.values()}
