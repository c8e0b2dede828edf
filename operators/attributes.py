"""Face attributes in Blender: names, codes, titles and units.

Every attribute is called `citypv_` + name and lives on the faces (domain FACE).

| name | type | meaning |
|---|---|---|
| `surface` | INT | polygon of the city, the row of faces.csv; -1 on ground that was generated |
| `building` | INT | place in the list `citypv_buildings` of the object; on the city only |
| `kind`, `orientation` | INT | codes of `KIND_CODES` and `ORIENTATION_CODES`, also kept on the object |
| the names of `RESULTS` | FLOAT | NaN where there is no such result, as on generated ground |
"""

from ..core.results.columns import COLUMNS

PREFIX = "citypv_"

KIND_CODES = {"facade": 0, "roof": 1, "flat": 2, "steep": 3, "downward": 4, "ground": 5, "rack": 6}
ORIENTATION_CODES = {"none": 0, "north": 1, "east": 2, "south": 3, "west": 4}
CODES = {"kind": KIND_CODES, "orientation": ORIENTATION_CODES}


QUANTITIES = tuple(column for column in COLUMNS if column.title)  # results stored as face attributes
RESULTS = {quantity.name: quantity for quantity in QUANTITIES}
TITLES = {"kind": "Kind of surface", "orientation": "Orientation"} | {q.name: q.title for q in QUANTITIES}
