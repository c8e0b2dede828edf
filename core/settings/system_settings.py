"""Settings of the modules, of the area that counts, and of the tables; part of
`core.settings.request.Request`.
"""

from dataclasses import dataclass

from .setting import of_electricity, setting

CLEARANCES = 0.01, 0.3  # [m] of the paper, where only what touches has no room, and of the default
PAPER_MODULE = "SunPower_SPR_300_WHT__2007__E__"
BUILDINGS = "buildings"  # in place of a surface's id
STRINGS = {
    "module": "An optimiser or inverter for each module: none loses by the shade on another",
    "string": "Modules in series: those of a storey, or of three rows, at most 20 m long",
}


@dataclass
class SystemSettings:
    """Settings about electricity."""

    method: str | None = of_electricity(
        None,
        "settings as in the paper (docs/reference/method_paper.md); others take precedence",
        choices=("paper",),
    )
    module: str = of_electricity(
        PAPER_MODULE,
        "module: name, or part of it, in pvlib's Sandia or CEC library",
        panel="energy",
        metavar="NAME",
    )
    mounting: str = of_electricity(
        "auto",
        "mounting of the modules, which determines the cell temperature",
        panel="energy",
        choices={
            "open-rack": "Air all around, glass/polymer (as in the paper)",
            "insulated-back": "On the wall or roof without a gap, glass/polymer",
            "close-mount": "Near the wall or roof, a little air behind, glass/glass",
            # last: files of Blender count choices
            "auto": "Near walls and pitched roofs; on open racks on level roofs",
        },
    )
    iam: str = of_electricity(
        "module",
        "incidence angle modifier of direct light",
        choices=("module", "physical", "ashrae"),
    )
    diffuse_iam: bool = of_electricity(False, "incidence angle modifier of diffuse light, too")
    # As pvlib.pvsystem.pvwatts_losses(shading=0): shading is traced.
    losses: float = of_electricity(
        11.4,
        "DC energy lost to soiling, mismatch, wiring, outages …",
        panel="energy",
        unit="%",
        least=0,
        most=99,
    )
    inverter: str | None = of_electricity(
        "pvwatts",
        "pvwatts, an inverter of pvlib's library, or none",
        panel="energy",
        metavar="NAME",
        none="none",
    )
    dc_ac_ratio: float = of_electricity(
        1.0, "nominal power of modules over that of the inverter", metavar="R", above=0, most=10
    )
    strings: str = of_electricity(
        "module",
        "what has a maximum power point of its own; what strings lose in shade is told with either",
        panel="energy",
        choices=STRINGS,
    )
    hidden_walls: str = of_electricity(
        "leave-out",
        "whether wall area that a neighbour covers counts",
        panel="energy",
        choices={
            "leave-out": "Area covered by neighbours carries no modules",
            "count": "Covered area counts like open area (as in the paper)",
        },
    )
    clearance: float = of_electricity(
        CLEARANCES[1],
        "room before a module, up to a face turned against it",
        panel="energy",
        unit="m",
        least=0,
    )
    sectors: str = setting(
        "8",
        "azimuths of roofs and facades that count",
        group="surfaces",
        panel="classify",
        choices={
            "8": "Facades and roofs of any azimuth, in eight sectors of 45°",
            "paper": (
                "Facades and roofs of 15° to 60° within 30° of north, east, south or west (as in "
                "the paper)"
            ),
        },
    )
    overhangs: str = of_electricity(
        "leave-out",
        "whether walls that lean outward by more than 1° are facades",
        choices=("leave-out", "count"),
    )
    usable: dict = of_electricity(
        {},
        "share that is left to modules by what the city does not show, by kind",
        kind="shares",
        metavar="KIND=SHARE",
    )
    least_hours: float = of_electricity(
        0.0,
        "full load hours of a long-term year below which a face carries no modules",
        title="Least hours",
        panel="energy",
        unit="h",
        metavar="H",
        least=0,
    )
    leave_out: str | None = of_electricity(
        None,
        "faces or buildings that carry no modules, such as protected ones: id,words",
        metavar="CSV",
    )
    layout: str = of_electricity(
        "rows",
        "how modules are laid out on what counts",
        panel="energy",
        choices={
            "rows": "Modules of the product's size in rows, between edges and windows",
            "area": "Every square metre that counts carries modules (as in the paper)",
        },
    )
    module_size: str | None = of_electricity(
        None, "[m] length and width of a module; default: the product's", metavar="L,W"
    )
    storey: float = of_electricity(
        3.0, "height of storeys where no windows are drawn", unit="m", least=1, most=20
    )
    window_band: float | None = of_electricity(
        None,
        "height of the windows of each storey where none are drawn; auto: 1.4, but 0 where "
        "--usable gives a share of facades",
        unit="m",
        least=0,
        most=20,
        none="auto",
    )
    ground_floor: bool = of_electricity(
        False, "modules on the lowest storey of facades with windows, too"
    )
    facades: str | None = of_electricity(
        None,
        "storey, window_band and usable share by surface id or kind",
        metavar="CSV",
    )
    series: tuple = of_electricity(
        (),
        f"ids of surfaces whose hourly series are written to series.csv; {BUILDINGS}: power of "
        "each in timeseries.nc",
        kind="names",
        metavar="ID",
    )
    monthly: bool = of_electricity(
        False, "add monthly full load hours to faces.csv and buildings.csv", kind="flag"
    )
    districts: str | None = of_electricity(
        None,
        "polygons with a name, for sums by district: FILE, or FILE:COLUMN with the names",
        metavar="FILE",
    )
